#include "drivers/kit/refusal.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast {

using Reason = command_status_t;

std::optional<Outcome> RefusalToBegin(bool busy, const DriverCommand& order, MonoNs now, bool link_up) {
  if (busy) return Rejected(Reason::REASON_BUSY, "another order is being carried out: wait for its outcome");
  if (now > order.begin_by) {
    return Final(CommandState::kExpired, Reason::REASON_DEADLINE, "nothing was done: its time to begin was over");
  }
  if (!link_up)
    return Rejected(Reason::REASON_DEVICE_OFFLINE, "the link is down: see the device's BUS for the cause");
  return std::nullopt;
}

std::optional<Outcome> RefusalInMotion(const Motion& motion) {
  if (motion.known && motion.standstill) return std::nullopt;
  return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(motion));
}

Result<> AsResult(const std::optional<Outcome>& refusal) {
  if (!refusal) return {};
  constexpr std::string_view kPrefix = "nothing was done: ";
  return Failure(refusal->text.substr(refusal->text.starts_with(kPrefix) ? kPrefix.size() : 0), refusal->reason);
}

}  // namespace axlecast
