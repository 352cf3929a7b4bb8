#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

namespace {

using Reason = command_status_t;

// From the end of one request's reply to the next request: the encoder's own 40 ms and a margin for both clocks.
// The reply proves that its request has arrived, whatever the adapter's delays.
constexpr MonoNs kResetInterval = 41 * kMillisecond;
// Requests of one sequence that the encoder may answer with a communication alarm, which means that it did not understand
// them. Each is sent again (spec 6.3.2 (4)).
constexpr int kMaxAlarmedRequests = 5;
// Readings that may fail in a row before and after the sequence.
constexpr int kReadsBefore = 3;
constexpr int kReadsAfter = 10;

// Ten requests of one reset, 41 ms apart, and the reading that shows their effect (TS5669 spec 9). It begins with a
// reading by ID 3, which shows the state before and ends a sequence that another process left unfinished. The two resets
// that move the position require a shaft at rest before each of the ten requests.
//
// A request that is answered with a communication alarm is sent again after the same interval (spec 6.3.2 (4)), a few
// times, as long as the shaft rests. It is not counted among the ten. Whether the encoder counts it is not documented:
// from ten requests on, alarmed ones included, a reading decides what was done.
//
// Any other request without a good reply, or a shaft that moves, ends the sequence before the tenth request: the encoder
// then does nothing. The driver's next request is ID 3, so that the sequence is never completed.
class ResetProcedure final : public Procedure {
 public:
  // `id`: kClearErrors, kZeroSingleTurn or kResetTurnsAndErrors.
  ResetProcedure(DataId id, const TFormatSettings& settings, const DeviceOutput& output)
      : id_(id), settings_(settings), output_(output) {}

  [[nodiscard]] Step Next(MonoNs now) const override {
    if (now < due_) return WaitUntil(due_);
    const bool send = stage_ == Stage::kSend && MayGoOn(now);
    return CommandStep(Ask(send ? id_ : DataId::kAll, settings_.timeout));
  }
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override {
    if (stage_ != Stage::kSend) return std::nullopt;
    in_flight_ = RequestId(request) == id_;
    if (in_flight_) return std::nullopt;
    if (!MayBeDone()) return NotAtRest(output_.MotionAt(now));
    stage_ = Stage::kVerify;  // the effect itself may be what looks like a motion
    return std::nullopt;
  }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    switch (stage_) {
      case Stage::kReadBefore:
        return OnBefore(answer);
      case Stage::kSend:
        return OnSent(answer, end);
      default:
        return OnVerified(answer);
    }
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
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
  [[nodiscard]] bool exclusive() const override { return stage_ != Stage::kReadBefore; }
  [[nodiscard]] bool touched() const override { return sent_ + alarmed_ > 0 || in_flight_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kVerify };

  [[nodiscard]] bool NeedsStandstill() const { return id_ != DataId::kClearErrors; }
  [[nodiscard]] bool MayGoOn(MonoNs now) const { return !NeedsStandstill() || AtRest(output_, now); }
  std::optional<Outcome> OnBefore(const Answer& answer) {
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
  std::optional<Outcome> OnSent(const Answer& answer, MonoNs end) {
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
  // Why the sequence ends with this answer, before the tenth request.
  [[nodiscard]] std::optional<Outcome> Ended(const Answer& answer) const {
    if (!answer.ok()) return Unanswered(answer);
    const std::int64_t moved =
        CircularDistance(*answer.reply.single_turn, *before_.single_turn, settings_.counts_per_turn);
    if (!NeedsStandstill() || moved <= ZeroToleranceCounts(settings_.format.single_turn_bits)) return std::nullopt;
    return Moved(moved);
  }
  void VerifyAt(MonoNs due) {
    stage_ = Stage::kVerify;
    due_ = due;
  }
  // Returns whether enough requests were sent that the encoder may have executed the reset, however it counts them.
  [[nodiscard]] bool MayBeDone() const { return sent_ + alarmed_ >= kResetTimes; }
  std::optional<Outcome> OnVerified(const Answer& answer) {
    if (answer.ok()) return Evaluate(answer.reply);
    silent_after_ = true;
    if (++failed_reads_ < kReadsBefore + kReadsAfter) return std::nullopt;
    return WithFindingBefore(
        Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
              Text("all %d requests were sent, but the reading that shows their effect failed (%s): read_all when "
                   "the encoder answers again",
                   kResetTimes, ErrorName(*answer.error))),
        SameBefore());
  }
  [[nodiscard]] Outcome NotAtRest(const Motion& motion) const {
    const bool begun = sent_ + alarmed_ > 0;
    std::int32_t reason = Reason::REASON_NOT_STANDING_STILL;
    if (begun && motion.known) reason = Reason::REASON_MOVED_DURING_SEQUENCE;
    return Final(CommandState::kRejected, reason,
                 Text("nothing was done, stopped after %d of %d requests: ", sent_ + alarmed_, kResetTimes) +
                     MotionText(motion));
  }
  [[nodiscard]] Outcome Moved(std::int64_t counts) const {
    return Final(
        CommandState::kRejected, Reason::REASON_MOVED_DURING_SEQUENCE,
        Text("nothing was done, stopped after %d of %d requests: the shaft moved %.3f deg since the first, at "
             "most %.2f are allowed; hold the axis",
             sent_ + alarmed_, kResetTimes, Degrees(counts, settings_.format.single_turn_bits), kZeroToleranceDeg));
  }
  [[nodiscard]] Outcome Unanswered(const Answer& answer) const {
    std::int32_t reason = Reason::REASON_NO_REPLY;
    if (answer.not_taken) reason = Reason::REASON_DEVICE_REFUSED;
    return Final(
        CommandState::kFailed, reason,
        Text("nothing was done, stopped after %d of %d requests: the reply to the last one was no good (%s); "
             "check the line and repeat",
             sent_ + alarmed_, kResetTimes, ErrorName(*answer.error)));
  }
  [[nodiscard]] Outcome Evaluate(const Reply& after) const {
    switch (id_) {
      case DataId::kZeroSingleTurn:
        return EvaluateZero(after);
      case DataId::kResetTurnsAndErrors:
        return EvaluateTurns(after);
      default:
        return EvaluateErrors(after);
    }
  }
  [[nodiscard]] Outcome EvaluateZero(const Reply& after) const {
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
  [[nodiscard]] Outcome EvaluateTurns(const Reply& after) const {
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
  [[nodiscard]] Outcome EvaluateErrors(const Reply& after) const {
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
  [[nodiscard]] std::uint8_t StillLatched(const Reply& after) const {
    const int mask = settings_.turns_range > 0 ? kLatchedAlarms : kLatchedAlarms & ~kMultiTurnAlarms;
    return static_cast<std::uint8_t>(*after.alarms & mask);
  }
  [[nodiscard]] std::string Lost() const { return tenth_lost_ ? "; the tenth reply was lost" : ""; }
  // Ten good replies prove that the encoder accepted the sequence, and the next reading at once that it had its power while it
  // stored the result (kWriteTime): it needs longer than that to start.
  [[nodiscard]] Outcome Fitting(const std::string& text) const {
    return WithFindingBefore(ReadBackOutcome({.same_before = SameBefore(),
                                              .confirmed = sent_ == kResetTimes && !tenth_lost_,
                                              .interrupted = silent_after_},
                                             text + Lost()),
                             SameBefore());
  }
  [[nodiscard]] bool SameBefore() const {
    if (id_ == DataId::kZeroSingleTurn) {
      return CannotBeToldApart(*before_.single_turn, 0, ZeroToleranceCounts(settings_.format.single_turn_bits),
                               settings_.counts_per_turn);
    }
    if (id_ == DataId::kResetTurnsAndErrors && !TurnsAreReset(before_, settings_)) return false;
    return StillLatched(before_) == 0;
  }

  const DataId id_;
  const TFormatSettings& settings_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs due_ = 0;
  int sent_ = 0;     // and not answered with a communication alarm
  int alarmed_ = 0;  // answered with one
  bool in_flight_ = false;
  bool tenth_lost_ = false;
  bool silent_after_ = false;  // a reading after the requests failed
  int failed_reads_ = 0;
  Reply before_;
};

}  // namespace

Result<std::unique_ptr<Procedure>> MakeReset(DataId id, const TFormatSettings& settings,
                                             const DeviceOutput& output) {
  return std::make_unique<ResetProcedure>(id, settings, output);
}

}  // namespace axlecast::tformat
