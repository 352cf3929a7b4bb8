#include "drivers/saa_serial/position_readout.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/saa_serial/zero_procedure.h"

namespace axlecast::saa_serial {

PositionReadout::PositionReadout(bool look, const SaaSettings& settings, const DeviceOutput& output,
                                 MonoNs patience, MonoNs now)
    : look_(look), settings_(settings), output_(output), begun_(now), deadline_(now + patience) {}

std::optional<Outcome> PositionReadout::OnReading(const Reading& reading, MonoNs now) {
  if (reading.error || reading.at.last < begun_) return OnTime(now);
  const int bits = settings_.format.bits;
  Outcome outcome = Final(CommandState::kSucceeded, command_status_t::REASON_NONE,
                          Text("single-turn %u (%.4f deg)", reading.counts, Degrees(reading.counts, bits)));
  outcome.verified = true;
  outcome.changes.push_back({"single_turn", "", std::to_string(reading.counts)});
  if (look_) outcome.changes.push_back(FindingChange(Finding(reading.counts, now)));
  return outcome;
}

std::optional<Outcome> PositionReadout::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, "no reading came in time");
}

Outcome PositionReadout::OnLinkLost() const {
  return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
               "the link was lost before the reading came");
}

// A shaft that turns may have left the place where it was zeroed.
const char* PositionReadout::Finding(std::uint32_t counts, MonoNs now) const {
  if (IsNearZero(counts, settings_)) return kReadsAsAfter;
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill ? kNoEffectSeen : kCannotTell;
}

}  // namespace axlecast::saa_serial
