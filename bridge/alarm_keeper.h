#pragma once

#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/alarm_store.h"
#include "bridge/bridge_order.h"
#include "bridge/instant.h"
#include "bridge/task.h"

namespace axlecast {

// What operators have said of alarms, beyond the life of the driver that shows it: gives a restarted driver back what
// it has forgotten, and ends what holds no more. Free of I/O but for the store.
class AlarmKeeper {
 public:
  explicit AlarmKeeper(AlarmStore& store) : store_(store) {}

  // A driver's boot is there. An order when it must be given something back; asked again until it has it all.
  [[nodiscard]] std::optional<BridgeOrder> OnHello(const std::string& device, std::int64_t boot_id, Instant now);
  // KIND_ACKNOWLEDGED: an alarm that this boot knew as acknowledged and names no more has gone.
  void OnAcknowledged(const driver_status_t& status);
  // The task has its outcome. May add to the status.
  void OnOutcome(Task& task);

 private:
  void Keep(Task& task, AlarmMark::Kind kind);
  void Restored(const Task& task);

  AlarmStore& store_;
};

}  // namespace axlecast
