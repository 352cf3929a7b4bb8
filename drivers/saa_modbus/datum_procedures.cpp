#include <cstdlib>
#include <utility>

#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/operations.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

bool IsZero(std::int64_t counts, const SaaModbusSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.bits);
}

// Reads the position, sends the request once, and reads again. The shaft must stand still before the first reading and
// before the request. The encoder's echo shows that the setting was accepted (SAA manual 5.1.7: "Sending a return
// match ... was set successfully"). A zero is verified by the reading; a direction cannot be verified without motion.
class DatumWrite final : public Procedure {
 public:
  DatumWrite(Parameter parameter, const OperationContext& context) : parameter_(parameter), context_(context) {}

  [[nodiscard]] ProcedureStep Next(MonoNs now) const override {
    if (now < due_) return Idle{due_};
    const std::uint8_t address = context_.connection.address;
    if (stage_ == Stage::kSend && AtRest(context_.output, now)) return SetParameterRequest(address, parameter_);
    return ReadAt{address};
  }

  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override {
    if (stage_ != Stage::kSend) return std::nullopt;
    const std::optional<Request> started = ParseRequest(request);
    sent_ = started && started->writes();
    if (sent_) return std::nullopt;
    return NotAtRest(context_.output.MotionAt(now));
  }

  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
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

  [[nodiscard]] Outcome OnLinkLost() const override {
    if (!sent_) return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost");
    return WithCounts(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                            "the link was lost after the request and before its effect could be read: "
                            "read_position when it is back"),
                      "");
  }

  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kReadAfter };

  // A zero whose effect does not show yet is read again.
  static constexpr MonoNs kReadAgain = 20 * kMillisecond;
  static constexpr int kZeroReadings = 5;
  // Maximum number of readings after the request that may fail.
  static constexpr int kReadsAfter = 10;

  std::optional<Outcome> OnBefore(const Answer& answer) {
    if (!answer.ok()) {
      if (++failures_ < kTries) return std::nullopt;
      return Rejected(Reason::REASON_NO_REPLY,
                      Text("the reading before it failed %d times (%s)", failures_, ErrorName(*answer.error)));
    }
    before_ = answer.reply.counts;
    stage_ = Stage::kSend;
    // If this process ends now, a later reading proves an effect only if the state before is known.
    return WithCounts({.text = "the position before it was read", .progress = 0.3F}, "");
  }

  std::optional<Outcome> OnAfter(const Answer& answer, MonoNs end) {
    if (!answer.ok()) {
      silent_after_ = true;
      if (++failures_ < kReadsAfter) return std::nullopt;
      return WithCounts(
          Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                Text("the request was sent%s, but the reading after it failed (%s): read_position when "
                     "the encoder answers again",
                     accepted_ ? " and echoed" : "", ErrorName(*answer.error))),
          "");
    }
    const std::int64_t counts = answer.reply.counts;
    if (parameter_ != Parameter::kZero) return WithCounts(DirectionOutcome(), std::to_string(counts));
    if (!IsZero(counts, context_.settings) && ++zero_readings_ < kZeroReadings) {
      due_ = end + kReadAgain;
      return std::nullopt;
    }
    return WithCounts(ZeroOutcome(counts), std::to_string(counts));
  }

  [[nodiscard]] Outcome ZeroOutcome(std::int64_t counts) const {
    const int bits = context_.settings.bits;
    const std::string text =
        "the position was " + PositionText(before_, bits) + " and is " + PositionText(counts, bits);
    if (!IsZero(counts, context_.settings)) {
      const char* echo = accepted_ ? "the encoder accepted it, but " : "the encoder's echo did not come, and ";
      return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, echo + text + ", not 0");
    }
    return ReadBackOutcome({.same_before = SameBefore(), .confirmed = accepted_, .interrupted = silent_after_},
                           text + (accepted_ ? "" : "; the echo did not come"));
  }

  [[nodiscard]] Outcome DirectionOutcome() const {
    if (!accepted_) {
      return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                   "the encoder's echo did not come: turn the shaft a little and see which way it counts");
    }
    if (silent_after_) {
      return Final(
          CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
          "the encoder accepted it, but was silent then and may have stored nothing: turn the shaft a little "
          "and see which way it counts");
    }
    return Succeeded(false,
                     "the encoder accepted it; nothing can be read back at rest: turn the shaft a little and see "
                     "which way it counts, then reference again");
  }

  [[nodiscard]] bool SameBefore() const {
    const SaaModbusSettings& settings = context_.settings;
    return CannotBeToldApart(before_, 0, ZeroToleranceCounts(settings.bits), settings.counts_per_turn);
  }

  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const {
    outcome.changes.push_back({"single_turn", std::to_string(before_), after});
    if (parameter_ != Parameter::kZero) return outcome;  // a direction cannot be found by a reading
    return WithFindingBefore(std::move(outcome), SameBefore());
  }

  const Parameter parameter_;
  const OperationContext& context_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs due_ = 0;
  std::int64_t before_ = 0;
  bool sent_ = false;
  bool accepted_ = false;      // the echo came
  bool silent_after_ = false;  // a reading after the request failed
  int failures_ = 0;
  int zero_readings_ = 0;
};

class ReadPosition final : public Procedure {
 public:
  ReadPosition(std::optional<Parameter> after, const OperationContext& context)
      : after_(after), context_(context) {}

  [[nodiscard]] ProcedureStep Next(MonoNs) const override { return ReadAt{context_.connection.address}; }

  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    if (!answer.ok()) return CountFailure(answer, failures_);
    Outcome outcome = PositionOutcome("", answer.reply.counts, context_.settings.bits);
    if (after_) outcome.changes.push_back(FindingChange(FindingAfter(answer.reply.counts, end)));
    return outcome;
  }

 private:
  // A shaft that turns may have left the place where it was zeroed. A direction does not show at rest.
  [[nodiscard]] const char* FindingAfter(std::int64_t counts, MonoNs now) const {
    if (after_ != Parameter::kZero) return kCannotTell;
    return FindingWord(IsZero(counts, context_.settings), AtRest(context_.output, now));
  }

  const std::optional<Parameter> after_;
  const OperationContext& context_;
  int failures_ = 0;
};

}  // namespace

std::unique_ptr<Procedure> MakeDatumWrite(Parameter parameter, const OperationContext& context) {
  return std::make_unique<DatumWrite>(parameter, context);
}

std::unique_ptr<Procedure> MakeReadPosition(std::optional<Parameter> after, const OperationContext& context) {
  return std::make_unique<ReadPosition>(after, context);
}

std::optional<Outcome> CountFailure(const Answer& answer, int& failures) {
  if (++failures < kTries) return std::nullopt;
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
               Text("asked %d times in vain (%s)", failures, ErrorName(*answer.error)));
}

Outcome PositionOutcome(const std::string& text, std::int64_t counts, int bits) {
  Outcome outcome = Verified(text + PositionText(counts, bits));
  outcome.changes.push_back({"single_turn", "", std::to_string(counts)});
  return outcome;
}

}  // namespace axlecast::saa_modbus
