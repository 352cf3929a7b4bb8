#pragma once

#include <axlecast/command_status_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "tools/monitor/monitor.h"
#include "tools/web/sample_history.h"

namespace axlecast {

// The frames of docs/web_protocol.md, each as one line of JSON.

// One time on both clocks; in a log, the time of the shown event.
struct WebTimestamp {
  MonoNs mono = 0;
  std::int64_t utime = 0;
};

// Whether the server answers questions to a fleet database, and whether it shows anything else.
enum class WebFleet : std::uint8_t { kNone, kBeside, kOnly };

struct WebLogFacts {
  std::vector<std::string> files;
  std::int64_t first_utime = 0;
  std::int64_t last_utime = 0;
};

// Name and unit of a column of samples.
struct WebColumn {
  std::string_view name;
  std::string unit;
};
[[nodiscard]] std::vector<WebColumn> ColumnsOf(const DeviceView& device, std::int8_t unit);

// `machine`: from the machine file. Devices that it does not list are known only from messages.
[[nodiscard]] std::string HelloFrame(const Monitor& monitor, const MachineConfig& machine, std::string_view version,
                                     const std::optional<WebLogFacts>& log, WebFleet fleet = WebFleet::kNone);
[[nodiscard]] std::string StateFrame(const Monitor& monitor, WebTimestamp now);
// `before`: the alarm names in the previous frame.
[[nodiscard]] std::string AlarmsFrame(std::string_view device, const AlarmView& alarms, std::int64_t utime,
                                      const std::set<std::string>& before);
[[nodiscard]] std::string TripFrame(const trip_log_t& trip);
[[nodiscard]] std::string CommandFrame(const command_status_t& status);
[[nodiscard]] std::string ErrorFrame(std::string_view text);
[[nodiscard]] std::string ResetFrame();

struct WebPlayback {
  std::int64_t utime = 0;
  bool playing = false;
  double speed = 1;
  bool at_end = false;
  bool seeking = false;
  bool operator==(const WebPlayback&) const = default;
};
[[nodiscard]] std::string PlaybackFrame(const WebPlayback& playback);

// Returns the power of a motor in the last kTrendUs before `utime`, at most one reading per second, for a small curve.
inline constexpr std::int64_t kTrendUs = 120'000'000;
[[nodiscard]] std::string TrendFrame(std::string_view device, const std::vector<WebColumn>& columns,
                                     const SampleHistory& history, std::int64_t utime);

// Returns the rows [begin, end) of `history`, at least one.
[[nodiscard]] std::string SamplesFrame(std::string_view device, const std::vector<WebColumn>& columns,
                                       const SampleHistory& history, std::uint64_t begin, std::uint64_t end,
                                       std::uint64_t dropped);

}  // namespace axlecast
