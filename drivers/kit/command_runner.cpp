#include "drivers/kit/command_runner.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

namespace axlecast {

using Reason = command_status_t;

Result<> CheckBegin(bool busy, const DriverCommand& command, MonoNs now, bool link_up) {
  if (busy) return Failure("another command is being carried out: wait for its outcome", Reason::REASON_BUSY);
  if (now > command.begin_by) return Failure("its time to begin was over", Reason::REASON_DEADLINE);
  if (!link_up) {
    return Failure("the link is down: see the device's BUS for the cause", Reason::REASON_DEVICE_OFFLINE);
  }
  return {};
}

Result<> CheckStandstill(const Motion& motion) {
  if (motion.known && motion.standstill) return {};
  return Failure(MotionText(motion), Reason::REASON_NOT_STANDING_STILL);
}

bool NeedsStandstill(std::span<const OperationSpec> operations, std::string_view operation) {
  return std::any_of(operations.begin(), operations.end(),
                     [&](const OperationSpec& spec) { return spec.name == operation && spec.needs_standstill; });
}

}  // namespace axlecast
