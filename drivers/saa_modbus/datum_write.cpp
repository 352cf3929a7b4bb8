#include "drivers/saa_modbus/datum_write.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/kit/refusal.h"

namespace axlecast::saa_modbus {

using Reason = command_status_t;

DatumWrite::DatumWrite(Parameter parameter, const SaaModbusSettings& settings, const Connection& connection,
                       const DeviceOutput& output)
    : parameter_(parameter), settings_(settings), connection_(connection), output_(output) {}

bool DatumWrite::AtRest(MonoNs now) const {
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill;
}

bool DatumWrite::IsZero(std::int64_t counts) const {
  return CircularDistance(counts, 0, settings_.counts_per_turn) <= ZeroToleranceCounts(settings_.bits);
}

bool DatumWrite::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(settings_.bits), settings_.counts_per_turn);
}

Want DatumWrite::Next(MonoNs now) const {
  if (now < due_) return WaitUntil{due_};
  if (stage_ == Stage::kSend && AtRest(now)) return Send{SetParameterRequest(connection_.address, parameter_)};
  return ReadAt{connection_.address};
}

std::optional<Outcome> DatumWrite::OnStarted(Bytes request, MonoNs now) {
  if (stage_ != Stage::kSend) return std::nullopt;
  const std::optional<Request> started = ParseRequest(request);
  if (started && started->writes()) {
    sent_ = true;
    return std::nullopt;
  }
  return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(output_.MotionAt(now)));
}

std::optional<Outcome> DatumWrite::OnAnswer(const Answer& answer, MonoNs end) {
  switch (stage_) {
    case Stage::kReadBefore:
      return OnBefore(answer);
    case Stage::kSend:
      accepted_ = answer.ok();
      stage_ = Stage::kReadAfter;
      failures_ = 0;
      return std::nullopt;
    default:
      return OnAfter(answer, end);
  }
}

std::optional<Outcome> DatumWrite::OnBefore(const Answer& answer) {
  if (!answer.ok()) {
    if (++failures_ < kTries) return std::nullopt;
    return Rejected(Reason::REASON_NO_REPLY,
                    Text("the reading before it failed %d times (%s)", failures_, ErrorName(*answer.error)));
  }
  before_ = answer.reply.counts;
  stage_ = Stage::kSend;
  Outcome running;
  running.text = "the position before it was read";
  running.progress = 0.3F;
  // Should this process die: what is found afterwards says something only beside what was before.
  return WithCounts(std::move(running), "");
}

std::optional<Outcome> DatumWrite::OnAfter(const Answer& answer, MonoNs end) {
  if (!answer.ok()) {
    if (++failures_ < kReadsAfter) return std::nullopt;
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            Text("the request was sent%s, but the reading after it failed (%s): read_position when "
                                 "the encoder answers again",
                                 accepted_ ? " and echoed" : "", ErrorName(*answer.error))),
                      "");
  }
  const std::int64_t counts = answer.reply.counts;
  if (parameter_ != Parameter::kZero) return JudgeDirection(counts);
  if (!IsZero(counts) && ++looks_ < kLooks) {
    due_ = end + kReadAgain;
    return std::nullopt;
  }
  return JudgeZero(counts);
}

Outcome DatumWrite::JudgeZero(std::int64_t counts) const {
  const std::string text = "the position was " + PositionText(before_, settings_.bits) + " and is " +
                           PositionText(counts, settings_.bits);
  const std::string after = std::to_string(counts);
  if (!IsZero(counts)) {
    const char* echo = accepted_ ? "the encoder accepted it, but " : "the encoder's echo did not come, and ";
    return WithCounts(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, echo + text + ", not 0"),
                      after);
  }
  return WithCounts(JudgeReadBack({.same_before = SameBefore(), .confirmed = accepted_},
                                  text + (accepted_ ? "" : "; the echo did not come")),
                    after);
}

Outcome DatumWrite::JudgeDirection(std::int64_t counts) const {
  const std::string after = std::to_string(counts);
  if (!accepted_) {
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the encoder's echo did not come: turn the shaft a little and see which way it counts"),
                      after);
  }
  return WithCounts(
      Succeeded(false,
                "the encoder accepted it; nothing can be read back at rest: turn the shaft a little and see "
                "which way it counts, then reference again"),
      after);
}

Outcome DatumWrite::OnLinkLost() const {
  if (sent_) {
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the link was lost after the request and before its effect could be read: "
                            "read_position when it is back"),
                      "");
  }
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost");
}

Outcome DatumWrite::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  if (parameter_ != Parameter::kZero) return outcome;  // a direction cannot be found by looking
  return WithFindingBefore(std::move(outcome), SameBefore());
}

}  // namespace axlecast::saa_modbus
