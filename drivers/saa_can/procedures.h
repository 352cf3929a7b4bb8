#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "drivers/saa_can/procedure.h"

namespace axlecast::saa_can {

// The maximum difference between positions of a shaft at rest.
inline constexpr std::int64_t kFlicker = 16;
// A shaft that is held, and an encoder that is slow.
inline constexpr int kMaxReadings = 5;

// "14.0625 deg (counts 640)"
inline std::string PositionText(std::int64_t counts, int bits) {
  return Text("%.4f deg (counts %lld)", Degrees(counts, bits), static_cast<long long>(counts));
}

// Returns whether the shaft is where a position has the bytes of the reply to this command.
inline bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings) {
  InlineBytes<kMaxCanData> reply{static_cast<std::uint8_t>(command), 0, 0, 0};
  const Position alike = ParsePosition(reply, settings.format);
  if (alike.error != PositionError::kNone) return false;
  return CircularDistance(counts, alike.counts, settings.counts_per_turn) <= kFlicker;
}

inline bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

// Returns an error if the direction cannot be set at this position, because it has the bytes of the reply.
inline Result<> CheckDirectionAt(std::int64_t counts, const SaaCanSettings& settings) {
  if (!LooksLikeReply(counts, Command::kDirection, settings)) return {};
  return NotPermitted("the shaft is at " + PositionText(counts, settings.format.bits) +
                      ", which has the bytes of the reply (22 00): turn it a little");
}

// Clears the encoder to zero (20 NN, SAA manual 5.4.1 (3) ⑥). Positions before and after the frame show the effect. The
// reply alone proves nothing: it looks like a position.
class Zero final : public OneFrameProcedure {
 public:
  Zero(const OperationContext& context, MonoNs now) : OneFrameProcedure(Command::kZero, 0, context, now) {}

  [[nodiscard]] MonoNs Due(MonoNs now) const override {
    const MonoNs effect_from = context_.interpreter.effect_from();
    return delivered() && now < effect_from ? std::min(effect_from, deadline_) : OneFrameProcedure::Due(now);
  }

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override {
    return context_.settings.zero_settle + Timeout(context_.settings);
  }
  // The changes of this progress are needed if this process dies: a later reading shows an effect only if the position
  // before is known.
  [[nodiscard]] std::optional<Outcome> Progress() const override {
    Outcome running;
    running.text = "the command was on the bus; waiting for a position that shows its effect";
    running.progress = 0.5F;
    return WithCounts(std::move(running), "");
  }
  std::optional<Outcome> AfterDelivery(const Event&, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override {
    const auto& reading = evaluation.reading;
    interrupted_ = interrupted_ || evaluation.overdue || (reading && reading->error);
    if (reading && !reading->error && reading->at.first >= context_.interpreter.effect_from()) {
      if (IsNearZero(reading->counts, context_.settings) || ++readings_ >= kMaxReadings)
        return Verify(reading->counts);
    }
    if (now < deadline_) return std::nullopt;
    return WithCounts(NotReceived(CommandState::kIndeterminate,
                                  "the command was on the bus, but no position came that shows its effect: "
                                  "read_position when the encoder sends again"),
                      "");
  }
  [[nodiscard]] bool NeedsPosition(MonoNs now) const override { return now >= context_.interpreter.effect_from(); }
  [[nodiscard]] std::string Check() const override { return "read_position after=zero"; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const override { return WithCounts(std::move(outcome), ""); }
  [[nodiscard]] bool SameBefore() const {
    return CannotBeToldApart(before_, 0, ZeroToleranceCounts(context_.settings.format.bits),
                             context_.settings.counts_per_turn);
  }
  [[nodiscard]] Outcome Verify(std::int64_t counts) const {
    const int bits = context_.settings.format.bits;
    const std::string text =
        "the position was " + PositionText(before_, bits) + " and is " + PositionText(counts, bits);
    const std::string after = std::to_string(counts);
    if (!IsNearZero(counts, context_.settings)) {
      return WithCounts(Final(CommandState::kFailed, command_status_t::REASON_READ_BACK_DIFFERS,
                              std::string(ReplyText()) + ", but " + text + ", not 0"),
                        after);
    }
    const bool may_be_position = LooksLikeReply(before_, Command::kZero, context_.settings);
    const char* reply = may_be_position && acknowledged_ ? "what came as its reply may be a position" : ReplyText();
    const ReadBack read_back = {
        .same_before = SameBefore(), .confirmed = acknowledged_ && !may_be_position, .interrupted = interrupted_};
    return WithCounts(ReadBackOutcome(read_back, text + "; " + reply), after);
  }
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const {
    outcome.changes.push_back({"single_turn", std::to_string(before_), after});
    return WithFindingBefore(std::move(outcome), SameBefore());
  }

  int readings_ = 0;
  bool interrupted_ = false;  // a position after the frame did not come, or was damaged
};

// Sets the counting direction (22 NN, SAA manual 5.4.1 (3) ④⑤) with the byte from the configuration. The reply shows that
// it was accepted; only a motion shows the effect. It is refused where a position of the shaft at rest could be taken for
// the reply.
class SetDirection final : public OneFrameProcedure {
 public:
  SetDirection(std::uint8_t parameter, const OperationContext& context, MonoNs now)
      : OneFrameProcedure(Command::kDirection, parameter, context, now) {}

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override { return context_.settings.reply_window; }
  std::optional<Outcome> AfterDelivery(const Event&, const Interpreter::Evaluation&, MonoNs now) override {
    if (acknowledged_) {
      return WithChanges(Succeeded(false,
                                   "the encoder accepted it; nothing can be read back at rest: turn the shaft a "
                                   "little and see which way it counts, then reference again"));
    }
    if (now < deadline_) return std::nullopt;
    return WithChanges(NotReceived(CommandState::kIndeterminate,
                                   "the command was on the bus, but no reply came: turn the shaft a little and see "
                                   "which way it counts"));
  }
  [[nodiscard]] Result<> CheckPosition(std::int64_t counts) const override {
    return CheckDirectionAt(counts, context_.settings);
  }
  [[nodiscard]] std::string Check() const override { return "turn the shaft and see which way it counts"; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const override {
    outcome.changes.push_back({"single_turn", std::to_string(before_), ""});
    return outcome;
  }
};

// The period of frames that an encoder sends by itself, measured from their arrivals.
class PeriodMeter {
 public:
  void Add(MonoNs at) {
    if (frames_++ == 0) first_ = at;
    last_ = at;
  }
  [[nodiscard]] bool done() const { return frames_ > kPeriods; }
  // Returns the mean period; 0 before the second frame.
  [[nodiscard]] MonoNs Mean() const { return frames_ < 2 ? 0 : (last_ - first_) / (frames_ - 1); }
  [[nodiscard]] double MeanMs() const { return static_cast<double>(Mean()) / static_cast<double>(kMillisecond); }
  // Returns whether the mean is within a quarter of the nominal period: the manual's own log is 6.4 % off.
  [[nodiscard]] bool Fits(MonoNs nominal) const {
    const MonoNs off = Mean() > nominal ? Mean() - nominal : nominal - Mean();
    return off * 4 <= nominal;
  }
  // Returns the maximum time of a measurement.
  [[nodiscard]] static MonoNs Timeout(MonoNs nominal) { return 2 * kSecond + 2 * kPeriods * nominal; }

 private:
  static constexpr int kPeriods = 5;

  int frames_ = 0;
  MonoNs first_ = 0;
  MonoNs last_ = 0;
};

// Sets how often the encoder sends by itself (31 NN TT, ⑦), and measures it.
class SetPeriod final : public OneFrameProcedure {
 public:
  SetPeriod(std::uint8_t per_second, const OperationContext& context)
      : OneFrameProcedure(Command::kPeriod, per_second, context), period_(kSecond / per_second) {}

 private:
  [[nodiscard]] MonoNs EffectTimeout() const override {
    return PeriodMeter::Timeout(std::max(period_, context_.interpreter.period()));
  }
  // The first position may come when the old period ends: the measurement begins with it.
  std::optional<Outcome> AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override {
    if (evaluation.reading && event.received.first > delivered_at()) meter_.Add(event.received.first);
    if (!meter_.done() && now < deadline_) return std::nullopt;
    if (!meter_.done()) {
      return NotReceived(
          CommandState::kIndeterminate,
          Text("the command was on the bus (%s), but too few positions came to measure their period: %s",
               ReplyText(), Check().c_str()));
    }
    const double measured = meter_.MeanMs();
    Outcome outcome =
        meter_.Fits(period_)
            ? Verified(
                  Text("a position comes every %.1f ms; this holds until the driver is restarted: put period_ms: "
                       "%lld into the file",
                       measured, InMilliseconds(period_)))
            : Final(CommandState::kFailed, command_status_t::REASON_READ_BACK_DIFFERS,
                    Text("%s, but a position comes every %.1f ms, not every %lld ms", ReplyText(), measured,
                         InMilliseconds(period_)));
    const double before = static_cast<double>(context_.settings.period) / static_cast<double>(kMillisecond);
    outcome.changes.push_back({"period_ms", Text("%.1f", before), Text("%.1f", measured)});
    return outcome;
  }
  [[nodiscard]] std::string Check() const override {
    return Text("read_position after=\"set_period period_ms=%lld\"", InMilliseconds(period_));
  }

  const MonoNs period_;
  PeriodMeter meter_;
};

// Stops an encoder that sends by itself (31 NN TT, ⑧) although it is polled, with the byte from the configuration. Then
// nothing is requested for a while, and nothing must be received.
class StopCyclic final : public OneFrameProcedure {
 public:
  StopCyclic(std::uint8_t parameter, const OperationContext& context)
      : OneFrameProcedure(Command::kPeriod, parameter, context) {}

  [[nodiscard]] bool alone() const override { return touched(); }

 private:
  // The time without a position: longer than the longest period, one position a second.
  static constexpr MonoNs kQuiet = 1'500 * kMillisecond;
  // For this time, a position may still come that was requested or on its way.
  static constexpr MonoNs kSettle = 100 * kMillisecond;

  [[nodiscard]] MonoNs EffectTimeout() const override { return kSettle + kQuiet; }
  std::optional<Outcome> AfterDelivery(const Event&, const Interpreter::Evaluation& evaluation,
                                       MonoNs now) override {
    if (evaluation.reading && now >= delivered_at() + kSettle) {
      return Final(CommandState::kFailed, command_status_t::REASON_READ_BACK_DIFFERS,
                   std::string(ReplyText()) + ", but the encoder still sends by itself: is stop_byte right?");
    }
    if (now < deadline_) return std::nullopt;
    return Verified(Text("for %lld ms no position came by itself", InMilliseconds(kQuiet)));
  }
  [[nodiscard]] std::string Check() const override { return "see whether positions come by themselves"; }
};

// Reads one position. It also shows whether the encoder reads as after the operation that was carried out before.
class ReadPosition final : public ReadProcedure {
 public:
  enum class After : std::uint8_t { kNothing, kZero, kDirection, kBitrate };
  ReadPosition(After after, const OperationContext& context, MonoNs now)
      : after_(after), context_(context), deadline_(now + Timeout(context.settings)) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override { return Position{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event&, const Interpreter::Evaluation& evaluation, MonoNs now) override {
    if (evaluation.reading && !evaluation.reading->error) {
      const std::int64_t counts = evaluation.reading->counts;
      Outcome outcome = Verified("the position is " + PositionText(counts, context_.settings.format.bits));
      outcome.changes.push_back({"single_turn", "", std::to_string(counts)});
      if (after_ != After::kNothing) outcome.changes.push_back(FindingChange(Finding(counts, now)));
      return outcome;
    }
    if (now < deadline_) return std::nullopt;
    return NotReceived(CommandState::kFailed, "no position came in time");
  }

 private:
  // A shaft that turns may have left the place where it was zeroed. A direction does not show at rest. An encoder that
  // answers at the present bit rate was not given another one, or does not use it yet.
  [[nodiscard]] const char* Finding(std::int64_t counts, MonoNs now) const {
    if (after_ != After::kZero) return after_ == After::kBitrate ? kNoEffectSeen : kCannotTell;
    return FindingWord(IsNearZero(counts, context_.settings), AtRest(context_.output, now));
  }

  const After after_;
  const OperationContext context_;
  const MonoNs deadline_;
};

// Measures how often the encoder sends by itself, to see whether set_period took effect.
class ReadPeriod final : public ReadProcedure {
 public:
  ReadPeriod(MonoNs period, const OperationContext& context, MonoNs now)
      : period_(period), deadline_(now + PeriodMeter::Timeout(std::max(period, context.interpreter.period()))) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override { return Nothing{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override {
    if (evaluation.reading) meter_.Add(event.received.first);
    if (!meter_.done() && now < deadline_) return std::nullopt;
    if (!meter_.done()) {
      return NotReceived(CommandState::kFailed, "too few positions came to measure their period");
    }
    Outcome outcome = Verified(Text("a position comes every %.1f ms", meter_.MeanMs()));
    outcome.changes.push_back({"period_ms", "", Text("%.1f", meter_.MeanMs())});
    outcome.changes.push_back(FindingChange(FindingWord(meter_.Fits(period_))));
    return outcome;
  }

 private:
  const MonoNs period_;
  const MonoNs deadline_;
  PeriodMeter meter_;
};

}  // namespace axlecast::saa_can
