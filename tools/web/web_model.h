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
#include "tools/monitor/time_agreement.h"
#include "tools/web/sample_history.h"
#include "tools/web/web_frames.h"

namespace axlecast {

// The content of the page: the state of the machine, the samples of the last minutes, and numbered frames of events, which
// every browser must get. All browsers of a live machine share one model; of a log, each has its own. It waits for no
// browser, and its memory is bounded.
class WebModel {
 public:
  static constexpr std::size_t kMaxRows = 30'000;        // of samples per device: 5 min at 100 Hz
  static constexpr std::size_t kMaxFurtherRows = 3'000;  // of devices after the first kManyRows
  static constexpr std::size_t kManyRows = 64;
  static constexpr std::size_t kUnlistedRows = 500;  // of a device that is not in the machine file
  static constexpr std::size_t kMaxEvents = 4096;
  static constexpr std::size_t kMaxEventBytes = 4U << 20;  // of event frames; the newest is always kept

  // `machine` must outlive it. `clock_id`: of this host, to whose UNIX time the readings of other hosts are converted. 0, as for a log:
  // readings keep the UNIX time of their hosts.
  WebModel(const MachineConfig& machine, std::string version, std::optional<WebLogFacts> log,
           std::int64_t clock_id = 0);

  void OnMessage(std::string_view channel, Bytes message, WebTimestamp now);
  // Updates the rates. Call it a few times per second.
  void Tick(MonoNs now) { monitor_.Tick(now); }
  void OnReception(const ReceptionCounts& counts) { monitor_.OnReception(counts); }

  // States in Hello what the server shows of a fleet. Call it before the first browser connects.
  void SetFleet(WebFleet fleet) { fleet_ = fleet; }

  [[nodiscard]] const Monitor& monitor() const { return monitor_; }
  // Increases when the content of Hello changes.
  [[nodiscard]] std::uint64_t layout() const { return monitor_.machine().layout(); }
  [[nodiscard]] std::string Hello() const { return HelloFrame(monitor_, machine_, version_, log_, fleet_); }
  // Returns the state frame; of a live machine, at most 200 ms old.
  [[nodiscard]] const std::string& State(WebTimestamp now);

  // Returns the frames for a new browser: all alarms, stored trips and commands, and the trends of motors.
  [[nodiscard]] std::vector<std::string> Past(std::int64_t utime) const;
  // Alarms, trips and commands since then, numbered.
  [[nodiscard]] std::uint64_t events_begin() const { return events_end_ - events_.size(); }
  [[nodiscard]] std::uint64_t events_end() const { return events_end_; }
  [[nodiscard]] std::size_t event_bytes() const { return event_bytes_; }
  [[nodiscard]] const std::string& event(std::uint64_t number) const {
    return events_[static_cast<std::size_t>(number - events_begin())];
  }

  // Returns the index of a device in monitor().machine().devices(), which never changes.
  [[nodiscard]] std::optional<std::size_t> IndexOf(std::string_view device) const;
  // Returns null before the first reading.
  [[nodiscard]] const SampleHistory* samples(std::size_t device) const;
  [[nodiscard]] std::vector<WebColumn> columns(std::size_t device) const;

 private:
  [[nodiscard]] std::size_t RowsFor(std::size_t device) const;
  // `utime`: UNIX time (us) of the host with the clock `clock_id`.
  void Add(std::size_t device, std::int64_t utime, std::int64_t clock_id, std::span<const double> row);
  void Publish(std::string frame);
  void PublishAlarms(const std::string& device, const AlarmView& alarms, std::int64_t utime);

  const MachineConfig& machine_;
  std::string version_;
  std::optional<WebLogFacts> log_;
  WebFleet fleet_ = WebFleet::kNone;
  const std::int64_t clock_id_;
  Monitor monitor_;
  UnixTimes unix_times_;
  std::vector<std::unique_ptr<SampleHistory>> samples_;
  std::map<std::string, std::set<std::string>> alarm_names_;  // as last published
  std::deque<std::string> events_;
  std::size_t event_bytes_ = 0;
  std::uint64_t events_end_ = 0;
  std::string state_;
  MonoNs state_at_ = 0;
};

}  // namespace axlecast
