#pragma once

#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Returns how many bytes per second a log of the machine's file grows: of the messages that drivers and recorder publish at the
// rates of the file, as records of an LCM log. An estimate: commands, trips and changes of state come on top, and readings that
// fail are missing. `log.trigger` is not regarded: it is the rate while the log records.
[[nodiscard]] double LogBytesPerSecond(const MachineConfig& machine, const LogConfig& log);

// A compressed log is so many times smaller, as measured on 60 MB of 100 simulated axes (zstd at level 3). An
// estimate for others.
inline constexpr double kCompressionFactor = 3.7;

// Returns how many bytes of logs the quota holds, as they were before the compression of closed logs.
[[nodiscard]] double QuotaHolds(const LogConfig& log);

// Returns after which time at this rate the quota deletes the oldest messages; nothing without a quota, and for a log that records
// only around a trigger.
[[nodiscard]] std::optional<MonoNs> QuotaLasts(const MachineConfig& machine, const LogConfig& log);

}  // namespace axlecast
