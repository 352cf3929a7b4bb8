#include "drivers/kit/command_runner.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

namespace axlecast {

using Reason = command_status_t;

tl::unexpected<Error> BadArgument(std::string text) {
  return Failure(std::move(text), Reason::REASON_BAD_ARGUMENT);
}

tl::unexpected<Error> NotPermitted(std::string text) {
  return Failure(std::move(text), Reason::REASON_NOT_PERMITTED);
}

tl::unexpected<Error> DeviceOffline(std::string text) {
  return Failure(std::move(text), Reason::REASON_DEVICE_OFFLINE);
}

tl::unexpected<Error> UnknownOperation(std::string_view family, std::string_view operation) {
  return Failure(std::string(family) + " has no operation " + std::string(operation),
                 Reason::REASON_UNKNOWN_OPERATION);
}

Result<> CheckBegin(bool busy, const DriverCommand& command, MonoNs now, bool link_up) {
  if (busy) return Failure("another command is being carried out: wait for its outcome", Reason::REASON_BUSY);
  if (now > command.begin_by) return Failure("its time to begin was over", Reason::REASON_DEADLINE);
  if (!link_up) return DeviceOffline("the link is down: see the device's BUS for the cause");
  return {};
}

Result<> CheckStandstill(const Motion& motion) {
  if (motion.known && motion.standstill) return {};
  return Failure(MotionText(motion), Reason::REASON_NOT_STANDING_STILL);
}

bool AtRest(const DeviceOutput& output, MonoNs now) {
  const Motion motion = output.MotionAt(now);
  return motion.known && motion.standstill;
}

std::string MotionText(const Motion& motion) {
  if (!motion.known) {
    return "too few fresh valid readings to see that the shaft rests: poll faster, or set limits: {speed_rpm: ...} "
           "for the axis";
  }
  return Text("the shaft turns at %.3g rpm; stop the axis and hold it", motion.speed_rpm);
}

Outcome NotAtRest(const Motion& motion) { return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(motion)); }

Outcome NeverAsked() {
  return RefusedOutcome(
      {"the device could not be asked before its time to begin was over", Reason::REASON_DEADLINE});
}

const OperationSpec* FindOperation(std::span<const OperationSpec> operations, std::string_view name) {
  const auto found = std::find_if(operations.begin(), operations.end(),
                                  [&](const OperationSpec& operation) { return operation.name == name; });
  return found == operations.end() ? nullptr : &*found;
}

// ---- what reading back proves ----

Outcome ReadBackOutcome(const ReadBack& read_back, std::string text) {
  if (!read_back.same_before) return Verified(std::move(text));
  if (read_back.confirmed && !read_back.interrupted) {
    return Succeeded(false, std::move(text) + ": as before; the device confirmed it, no effect can be seen");
  }
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      std::move(text) + (read_back.confirmed
                             ? ": as before; the device confirmed it, but it was silent before this reading "
                               "and may have stored nothing"
                             : ": as before, and nothing confirms that it was taken"));
}

bool CannotBeToldApart(std::int64_t before, std::int64_t wanted, std::int64_t tolerance, std::int64_t range) {
  return CircularDistance(before, wanted, range) <= 2 * tolerance;
}

Change FindingChange(const char* word) { return {"finding", "", word}; }

Outcome WithFindingBefore(Outcome outcome, bool reads_as_after) {
  const bool open = outcome.state == CommandState::kRunning || outcome.state == CommandState::kIndeterminate;
  if (open) outcome.changes.push_back({"finding", FindingWord(reads_as_after), ""});
  return outcome;
}

std::int64_t NoiseOfAccuracy(int arc_seconds, int single_turn_bits) {
  constexpr std::int64_t kPerTurn = 360 * 3'600;
  const std::int64_t scaled = 2 * std::int64_t{arc_seconds} << static_cast<unsigned>(single_turn_bits);
  return std::max<std::int64_t>(1, (scaled + kPerTurn - 1) / kPerTurn);
}

}  // namespace axlecast
