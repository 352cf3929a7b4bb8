#include "drivers/saa_serial/zero_procedure.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/kit/read_back.h"

namespace axlecast::saa_serial {
namespace {

using Reason = command_status_t;

// An 8-bit sum lets one damaged frame in 256 pass: it takes two readings in a row to tell, of at most five.
constexpr int kNearToSucceed = 2;
constexpr int kMaxReadings = 5;

}  // namespace

bool IsNearZero(std::uint32_t counts, const SaaSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

ZeroProcedure::ZeroProcedure(const SaaSettings& settings, const DeviceOutput& output, MonoNs patience, MonoNs now)
    : settings_(settings), output_(output), patience_(patience), deadline_(now + patience) {}

// Nothing answers a request to clear to zero: where the shaft stood near 0 already, nothing shows its effect.
bool ZeroProcedure::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(settings_.format.bits), settings_.counts_per_turn);
}

bool ZeroProcedure::AtRest(MonoNs now) const {
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill;
}

Procedure::Want ZeroProcedure::Wants(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return Want::kReading;
    case Stage::kSend:
      return AtRest(now) ? Want::kZero : Want::kReading;
    case Stage::kSent:
      return Want::kNothing;
    default:
      return now < effect_from_ ? Want::kNothing : Want::kReading;
  }
}

std::optional<Outcome> ZeroProcedure::OnReading(const Reading& reading, MonoNs now) {
  if (stage_ == Stage::kSettle) return Verify(reading);
  if (reading.error || stage_ == Stage::kSent) return OnTime(now);
  if (!AtRest(now)) return NotAtRest(output_.MotionAt(now));
  before_ = reading.counts;
  stage_ = Stage::kSend;
  return std::nullopt;
}

std::optional<Outcome> ZeroProcedure::OnTime(MonoNs now) {
  if (now < deadline_ || stage_ == Stage::kSent) return std::nullopt;
  if (!touched()) {
    return Final(CommandState::kRejected, Reason::REASON_NO_REPLY,
                 "nothing was done: no reading came to begin with");
  }
  return WithBefore(
      Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            "the request to clear to zero went out, but no reading came that shows its effect: read_position when "
            "the encoder is heard again"),
      "");
}

std::optional<Outcome> ZeroProcedure::OnZeroed(MonoNs effect_from) {
  stage_ = Stage::kSettle;
  effect_from_ = effect_from;
  deadline_ = effect_from + patience_;
  Outcome running;
  running.text = "the request to clear to zero went out; waiting for a reading that shows its effect";
  running.progress = 0.5F;
  // Should this process die: what is found afterwards says something only beside what was before.
  return WithBefore(std::move(running), "");
}

std::optional<Outcome> ZeroProcedure::Verify(const Reading& reading) {
  if (reading.error || reading.at.first < effect_from_) return OnTime(reading.at.last);
  ++readings_;
  near_in_a_row_ = IsNearZero(reading.counts, settings_) ? near_in_a_row_ + 1 : 0;
  if (near_in_a_row_ < kNearToSucceed && readings_ < kMaxReadings) return OnTime(reading.at.last);
  return Judge(reading.counts);
}

Outcome ZeroProcedure::Judge(std::uint32_t counts) const {
  const int bits = settings_.format.bits;
  const double allowed = Degrees(ZeroToleranceCounts(bits), bits);
  const bool near = near_in_a_row_ >= kNearToSucceed;
  const std::string was =
      Text("single-turn was %.3f deg and reads %.3f deg", Degrees(before_, bits), Degrees(counts, bits));
  Outcome outcome = near ? JudgeReadBack({.same_before = SameBefore()}, was + Text(" (0 +- %.2f)", allowed))
                         : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                 was + Text(", not 0 +- %.2f: hold the axis; is it the variant with zero clearing, "
                                            "and is its line or command right?",
                                            allowed));
  return WithBefore(std::move(outcome), std::to_string(counts));
}

Outcome ZeroProcedure::WithBefore(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

Outcome ZeroProcedure::OnLinkLost() const {
  if (!touched()) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                          "the link was lost after the request to clear to zero and before its effect could be "
                          "read: read_position when the link is back"),
                    "");
}

}  // namespace axlecast::saa_serial
