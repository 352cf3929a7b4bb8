#include "drivers/tformat/reset_procedure.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/kit/read_back.h"
#include "drivers/tformat/alarms.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

bool TurnsAreReset(const Reply& all, const TFormatSettings& settings) {
  const std::uint32_t turns = *all.multi_turn;
  if (turns == 0) return true;
  if (!IsZero(all, settings)) return false;
  const std::uint32_t last = (1U << static_cast<unsigned>(settings.format.multi_turn_bits)) - 1;
  const bool low_half = *all.single_turn < settings.counts_per_turn / 2;
  return low_half ? turns == 1 : turns == last;
}

bool IsZero(const Reply& all, const TFormatSettings& settings) {
  return CircularDistance(*all.single_turn, 0, settings.counts_per_turn) <=
         ZeroToleranceCounts(settings.format.single_turn_bits);
}

namespace {

using Reason = command_status_t;

// Readings that may fail in a row before and after the sequence.
constexpr int kReadsBefore = 3;
constexpr int kReadsAfter = 10;

}  // namespace

ResetProcedure::ResetProcedure(DataId id, const TFormatSettings& settings, const DeviceOutput& output)
    : id_(id), settings_(settings), output_(output) {}

Step ResetProcedure::Next(MonoNs now) const {
  if (now < due_) return WaitUntil(due_);
  const bool send = stage_ == Stage::kSend && MayGoOn(now);
  return CommandStep(Ask(send ? id_ : DataId::kAll, settings_.timeout));
}

bool ResetProcedure::MayGoOn(MonoNs now) const {
  if (!NeedsStandstill()) return true;
  const Motion motion = output_.MotionAt(now);
  return motion.known && motion.standstill;
}

std::optional<Outcome> ResetProcedure::OnStarted(Bytes request, MonoNs now) {
  if (stage_ != Stage::kSend) return std::nullopt;
  in_flight_ = RequestId(request) == id_;
  if (in_flight_) return std::nullopt;
  if (!MayBeDone()) return NotAtRest(output_.MotionAt(now));
  stage_ = Stage::kVerify;  // the effect itself may be what looks like a motion
  return std::nullopt;
}

std::optional<Outcome> ResetProcedure::OnAnswer(const Answer& answer, MonoNs end) {
  switch (stage_) {
    case Stage::kReadBefore:
      return OnBefore(answer);
    case Stage::kSend:
      return OnSent(answer, end);
    default:
      return OnVerified(answer);
  }
}

std::optional<Outcome> ResetProcedure::OnBefore(const Answer& answer) {
  if (!answer.ok()) {
    if (++failed_reads_ < kReadsBefore) return std::nullopt;
    return Final(CommandState::kRejected, Reason::REASON_NO_REPLY,
                 Text("nothing was done: the reading before the sequence failed %d times (%s)", failed_reads_,
                      ErrorName(*answer.error)));
  }
  before_ = answer.reply;
  if (id_ == DataId::kZeroSingleTurn) {
    if (const auto alarms = CheckAlarms(kZeroSingleTurnName, before_.alarms); !alarms) {
      return RefusedOutcome(alarms.error());
    }
  }
  stage_ = Stage::kSend;
  return std::nullopt;
}

void ResetProcedure::VerifyAt(MonoNs due) {
  stage_ = Stage::kVerify;
  due_ = due;
}

// Why the sequence ends with this answer, before the tenth request.
std::optional<Outcome> ResetProcedure::Ended(const Answer& answer) const {
  if (!answer.ok()) return Unanswered(answer);
  const std::int64_t moved =
      CircularDistance(*answer.reply.single_turn, *before_.single_turn, settings_.counts_per_turn);
  if (!NeedsStandstill() || moved <= ZeroToleranceCounts(settings_.format.single_turn_bits)) return std::nullopt;
  return Moved(moved);
}

std::optional<Outcome> ResetProcedure::OnSent(const Answer& answer, MonoNs end) {
  in_flight_ = false;
  const bool alarmed = answer.error == ErrorKind::kCommunicationAlarm;
  ++(alarmed ? alarmed_ : sent_);
  const bool again = alarmed && alarmed_ <= kMaxAlarmedRequests;
  due_ = end + kResetInterval;
  if (sent_ == kResetTimes) {
    tenth_lost_ = !answer.ok();
    VerifyAt(end + kWriteTime);
  } else if (!again) {
    std::optional<Outcome> ended = Ended(answer);
    if (ended && !MayBeDone()) return ended;
    if (ended) VerifyAt(end + kWriteTime);
  }
  Outcome running;
  running.text = Text("request %d of %d answered%s", sent_, kResetTimes, alarmed ? "; one is sent again" : "");
  running.progress = static_cast<float>(sent_) / static_cast<float>(kResetTimes + 1);
  // If this process ends now, a later reading proves an effect only if the state before is known.
  running.changes = {{"single_turn", std::to_string(*before_.single_turn), ""},
                     {"turns", std::to_string(*before_.multi_turn), ""},
                     {"alarms", AlarmText(*before_.alarms), ""}};
  return WithFindingBefore(std::move(running), SameBefore());
}

std::optional<Outcome> ResetProcedure::OnVerified(const Answer& answer) {
  if (answer.ok()) return Evaluate(answer.reply);
  if (++failed_reads_ < kReadsBefore + kReadsAfter) return std::nullopt;
  return WithFindingBefore(
      Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            Text("all %d requests were sent, but the reading that shows their effect failed (%s): read_all when "
                 "the encoder answers again",
                 kResetTimes, ErrorName(*answer.error))),
      SameBefore());
}

Outcome ResetProcedure::NotAtRest(const Motion& motion) const {
  const bool begun = sent_ + alarmed_ > 0;
  std::int32_t reason = Reason::REASON_NOT_STANDING_STILL;
  if (begun && motion.known) reason = Reason::REASON_MOVED_DURING_SEQUENCE;
  return Final(CommandState::kRejected, reason,
               Text("nothing was done, stopped after %d of %d requests: ", sent_ + alarmed_, kResetTimes) +
                   MotionText(motion));
}

Outcome ResetProcedure::Moved(std::int64_t counts) const {
  return Final(
      CommandState::kRejected, Reason::REASON_MOVED_DURING_SEQUENCE,
      Text("nothing was done, stopped after %d of %d requests: the shaft moved %.3f deg since the first, at "
           "most %.2f are allowed; hold the axis",
           sent_ + alarmed_, kResetTimes, Degrees(counts, settings_.format.single_turn_bits), kZeroToleranceDeg));
}

Outcome ResetProcedure::Unanswered(const Answer& answer) const {
  std::int32_t reason = Reason::REASON_NO_REPLY;
  if (answer.not_taken) reason = Reason::REASON_DEVICE_REFUSED;
  return Final(
      CommandState::kFailed, reason,
      Text("nothing was done, stopped after %d of %d requests: the reply to the last one was no good (%s); "
           "check the line and repeat",
           sent_ + alarmed_, kResetTimes, ErrorName(*answer.error)));
}

Outcome ResetProcedure::OnLinkLost() const {
  const int possible = sent_ + alarmed_ + (in_flight_ ? 1 : 0);
  if (possible >= kResetTimes) {
    return WithFindingBefore(
        Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
              "the link was lost after the tenth request and before its effect could be read: read_all when the "
              "link is back"),
        SameBefore());
  }
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
               Text("nothing was done: the link was lost after %d of %d requests", possible, kResetTimes));
}

Outcome ResetProcedure::Evaluate(const Reply& after) const {
  switch (id_) {
    case DataId::kZeroSingleTurn:
      return EvaluateZero(after);
    case DataId::kResetTurnsAndErrors:
      return EvaluateTurns(after);
    default:
      return EvaluateErrors(after);
  }
}

// Ten good replies prove that the encoder accepted the sequence.
Outcome ResetProcedure::Fitting(const std::string& text) const {
  return WithFindingBefore(
      JudgeReadBack({.same_before = SameBefore(), .confirmed = sent_ == kResetTimes && !tenth_lost_},
                    text + Lost()),
      SameBefore());
}

bool ResetProcedure::SameBefore() const {
  if (id_ == DataId::kZeroSingleTurn) {
    return CannotBeToldApart(*before_.single_turn, 0, ZeroToleranceCounts(settings_.format.single_turn_bits),
                             settings_.counts_per_turn);
  }
  if (id_ == DataId::kResetTurnsAndErrors && !TurnsAreReset(before_, settings_)) return false;
  return StillLatched(before_) == 0;
}

std::string ResetProcedure::Lost() const { return tenth_lost_ ? "; the tenth reply was lost" : ""; }

Outcome ResetProcedure::EvaluateZero(const Reply& after) const {
  const int bits = settings_.format.single_turn_bits;
  const double was = Degrees(*before_.single_turn, bits);
  const double is = Degrees(*after.single_turn, bits);
  Outcome outcome =
      IsZero(after, settings_)
          ? Fitting(Text("single-turn was %.3f deg and reads %.3f deg (0 +- %.2f)", was, is, kZeroToleranceDeg))
          : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                  Text("single-turn was %.3f deg and reads %.3f deg, not 0 +- %.2f", was, is, kZeroToleranceDeg) +
                      Lost() + ": hold the axis, repeat");
  outcome.changes.push_back(
      {"single_turn", std::to_string(*before_.single_turn), std::to_string(*after.single_turn)});
  return outcome;
}

std::uint8_t ResetProcedure::StillLatched(const Reply& after) const {
  const int mask = settings_.turns_range > 0 ? kLatchedAlarms : kLatchedAlarms & ~kMultiTurnAlarms;
  return static_cast<std::uint8_t>(*after.alarms & mask);
}

Outcome ResetProcedure::EvaluateTurns(const Reply& after) const {
  const std::string turns =
      Text("turns were %u and read %u, ALMC was %s and is %s", *before_.multi_turn, *after.multi_turn,
           AlarmText(*before_.alarms).c_str(), AlarmText(*after.alarms).c_str());
  const bool done = TurnsAreReset(after, settings_) && StillLatched(after) == 0;
  Outcome outcome = done ? Fitting(turns)
                         : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                 turns + Lost() + ": see the alarms' actions, hold the axis, repeat");
  outcome.changes.push_back({"turns", std::to_string(*before_.multi_turn), std::to_string(*after.multi_turn)});
  outcome.changes.push_back({"alarms", AlarmText(*before_.alarms), AlarmText(*after.alarms)});
  return outcome;
}

Outcome ResetProcedure::EvaluateErrors(const Reply& after) const {
  const std::uint8_t latched = StillLatched(after);
  const std::string alarms =
      Text("ALMC was %s and is %s", AlarmText(*before_.alarms).c_str(), AlarmText(*after.alarms).c_str());
  const char* live =
      (*after.alarms & ~latched) != 0 ? ": what is left is live and clears itself with its cause" : "";
  Outcome outcome = latched == 0
                        ? Fitting(alarms + live)
                        : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                alarms + Lost() + ": still set " + AlarmText(latched) + ", remove its cause");
  outcome.changes.push_back({"alarms", AlarmText(*before_.alarms), AlarmText(*after.alarms)});
  return outcome;
}

}  // namespace axlecast::tformat
