#pragma once

#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/state/command_store.h"
#include "bridge/store/durable_store.h"
#include "core/base/time.h"

namespace axlecast {

// Keeps acknowledgements and shelvings of alarms beyond the life of the driver. Returns them to a restarted driver, and
// removes those that have ended. Free of I/O but for the store.
class AlarmStateStore {
 public:
  explicit AlarmStateStore(DeviceRecords& store) : store_(store) {}

  // A driver's boot is there. An order when it must be given something back; asked again until it has it all.
  [[nodiscard]] std::optional<BridgeCommand> OnHello(const std::string& device, std::int64_t boot_id,
                                                     Timestamp now);
  // KIND_ACKNOWLEDGED: an alarm that this boot knew as acknowledged and names no more has gone.
  void OnAcknowledged(const driver_status_t& status);
  // The command has its outcome. May add to the status.
  void OnOutcome(PendingCommand& pending);

 private:
  void Keep(PendingCommand& pending, AlarmMark::Kind kind);
  void Restored(const PendingCommand& pending);

  DeviceRecords& store_;
};

}  // namespace axlecast
