#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/monitor/monitor.h"
#include "tools/web/sample_history.h"
#include "tools/web/web_frames.h"

namespace axlecast {

// The machine as the page shows it: its messages' state, the samples of the last minutes, and as numbered frames what no
// browser may miss. All browsers of a live machine look at one; of a log each at its own. Nothing in it waits for a
// browser, and what it holds is bounded.
class WebModel {
 public:
  static constexpr std::size_t kMaxRows = 30'000;        // of samples a device: 5 min at 100 Hz
  static constexpr std::size_t kMaxFurtherRows = 3'000;  // of the devices behind the first kManyRows
  static constexpr std::size_t kManyRows = 64;
  static constexpr std::size_t kStrangersRows = 500;  // of a device that a file with others does not list
  static constexpr std::size_t kMaxEvents = 4096;
  static constexpr std::size_t kMaxEventBytes = 4U << 20;  // of their frames; the newest is always kept

  // `machine` outlives it.
  WebModel(const MachineConfig& machine, std::string version, std::optional<WebLogFacts> log);

  void OnMessage(std::string_view channel, Bytes message, WebTimestamp now);
  // At least a few times a second.
  void Tick(MonoNs now) { monitor_.Tick(now); }
  void OnReception(const ReceptionCounts& counts) { monitor_.OnReception(counts); }

  [[nodiscard]] const Monitor& monitor() const { return monitor_; }
  // Increases when hello says something else.
  [[nodiscard]] std::uint64_t layout() const { return layout_; }
  [[nodiscard]] std::string Hello() const { return HelloFrame(monitor_, machine_, version_, log_); }
  // Of a live machine, of an instant that is at most 200 ms before `now`.
  [[nodiscard]] const std::string& State(WebTimestamp now);

  // What a new browser is told: all alarms, the trips and commands that are remembered, and the trends of motors.
  [[nodiscard]] std::vector<std::string> Past(std::int64_t utime) const;
  // What happened since: alarms, trips and commands, numbered.
  [[nodiscard]] std::uint64_t events_begin() const { return events_end_ - events_.size(); }
  [[nodiscard]] std::uint64_t events_end() const { return events_end_; }
  [[nodiscard]] std::size_t event_bytes() const { return event_bytes_; }
  [[nodiscard]] const std::string& event(std::uint64_t number) const {
    return events_[static_cast<std::size_t>(number - events_begin())];
  }

  // The index of a device in monitor().machine().devices(), which it keeps.
  [[nodiscard]] std::optional<std::size_t> IndexOf(std::string_view device) const;
  // Null before its first reading.
  [[nodiscard]] const SampleHistory* samples(std::size_t device) const;
  [[nodiscard]] std::vector<WebColumn> columns(std::size_t device) const;

 private:
  [[nodiscard]] std::size_t RowsFor(std::size_t device) const;
  void Add(std::size_t device, std::int64_t utime, std::span<const double> row);
  void Tell(std::string frame);
  void TellAlarms(const std::string& device, const AlarmView& alarms, std::int64_t utime);
  void FollowLayout();

  const MachineConfig& machine_;
  std::string version_;
  std::optional<WebLogFacts> log_;
  Monitor monitor_;
  std::vector<std::unique_ptr<SampleHistory>> samples_;
  std::map<std::string, std::set<std::string>> alarm_names_;  // as told last
  std::deque<std::string> events_;
  std::size_t event_bytes_ = 0;
  std::uint64_t events_end_ = 0;
  std::uint64_t layout_ = 1;
  std::size_t parts_ = 0;  // devices and buses, and what is known of unlisted ones
  std::string state_;
  MonoNs state_at_ = 0;
};

}  // namespace axlecast
