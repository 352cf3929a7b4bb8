#include "bridge/dispatch/recovery.h"

#include "core/command/command_id.h"
#include "core/command/operation_check.h"

namespace axlecast {

using S = command_status_t;

PendingCommand RecoveredCommand(const MachineConfig& machine, const OpenCommand& command) {
  PendingCommand task;
  task.status = command.record.status;
  task.id = IdOf(task.status.id);
  task.device = task.status.device;
  task.arguments = command.record.arguments;
  task.who = command.record.who;
  task.reason = command.record.reason;
  if (const BusConfig* bus = machine.BusOf(task.device)) {
    task.operation = FindOperation(*bus->family, task.status.operation);
  }
  return task;
}

void GiveUp(S& status, Timestamp now) {
  const bool sent = status.driver_boot_id != 0;
  status.state = sent ? S::STATE_INDETERMINATE : S::STATE_REJECTED;
  status.finding = sent ? S::FINDING_CANNOT_TELL : S::FINDING_NONE;
  status.reason_code = S::REASON_BRIDGE_RESTARTED;
  status.text = sent ? "the bridge restarted, and the machine's file has this device or operation no more"
                     : "the bridge restarted before it was sent: nothing was done; send it again";
  status.finished_utime = now.utime;
}

}  // namespace axlecast
