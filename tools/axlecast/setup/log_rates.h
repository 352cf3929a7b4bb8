#pragma once

#include <optional>

#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Returns how many bytes per second a log of the machine's file grows: of the messages that drivers and recorder publish at the
// rates of the file, as records of an LCM log. An estimate: commands, trips and changes of state come on top, and readings that
// fail are missing. `log.trigger` is not regarded: it is the rate while the log records.
[[nodiscard]] double LogBytesPerSecond(const MachineConfig& machine, const LogConfig& log);

// Returns after which time at this rate the quota deletes the oldest messages; nothing without a quota, and for a log that records
// only around a trigger.
[[nodiscard]] std::optional<MonoNs> QuotaLasts(const MachineConfig& machine, const LogConfig& log);

}  // namespace axlecast
