#include "drivers/saa_can/procedures.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

constexpr MonoNs kMinTimeout = 2 * kSecond;
constexpr int kTimeoutPeriods = 10;
// The maximum difference between positions of a shaft at rest.
constexpr std::int64_t kFlicker = 16;
// A shaft that is held, and an encoder that is slow.
constexpr int kMaxReadings = 5;

// Returns the maximum time for a position: several periods of a slow encoder, or several requests without a reply.
MonoNs Timeout(const SaaCanSettings& settings) { return std::max(kMinTimeout, kTimeoutPeriods * settings.period); }

// "14.0625 deg (counts 640)"
std::string PositionText(std::int64_t counts, int bits) {
  return Text("%.4f deg (counts %lld)", Degrees(counts, bits), static_cast<long long>(counts));
}

// Returns whether the shaft is where a position has the bytes of the reply to this command.
bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings) {
  InlineBytes<kMaxCanData> reply{static_cast<std::uint8_t>(command), 0, 0, 0};
  const Position alike = ParsePosition(reply, settings.format);
  if (alike.error != PositionError::kNone) return false;
  return CircularDistance(counts, alike.counts, settings.counts_per_turn) <= kFlicker;
}

bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

long long InMilliseconds(MonoNs time) { return static_cast<long long>(time / kMillisecond); }

}  // namespace

void Delivery::On(const Event& event, MonoNs now) {
  const Bytes data = frame_.data;
  const bool same =
      event.id == frame_.id && std::equal(event.bytes.begin(), event.bytes.end(), data.begin(), data.end());
  if (state_ == State::kStarted && same && event.kind == Event::Kind::kSent) {
    state_ = State::kQueued;
    at_ = now;
  } else if (state_ == State::kStarted && same && event.kind == Event::Kind::kNotSent) {
    state_ = State::kRefused;
  } else if (state_ == State::kQueued && same && event.kind == Event::Kind::kConfirmed) {
    state_ = State::kOnBus;
    at_ = now;
  } else if (state_ == State::kQueued && now >= due()) {
    state_ = State::kNotConfirmed;
  }
}

std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings) {
  if (delivery.state() == Delivery::State::kRefused) {
    return NotReceived(
        CommandState::kFailed,
        "nothing was done: the controller's queue is full, because no node acknowledges what is sent: check "
        "cable, termination and bit rate");
  }
  if (delivery.state() != Delivery::State::kNotConfirmed) return std::nullopt;
  return NotReceived(
      CommandState::kIndeterminate,
      Text("no node acknowledged the frame in %lld ms: it may still wait in the controller's queue and act "
           "later; drop it with: sudo ip link set %s down",
           InMilliseconds(Delivery::kConfirmWithin), settings.iface.c_str()));
}

Outcome LinkLostBefore() {
  return NotReceived(CommandState::kFailed, "nothing was done: the link was lost before it");
}

Outcome LinkLostAfter(const std::string& check) {
  return NotReceived(
      CommandState::kIndeterminate,
      "the link was lost after the request and before its effect could be seen: " + check + " when it is back");
}

Outcome NotReceived(CommandState state, std::string text) {
  return Final(state, Reason::REASON_NO_REPLY, std::move(text));
}

// ---- OneFrameProcedure ----

OneFrameProcedure::OneFrameProcedure(Command command, std::uint8_t parameter, const OperationContext& context,
                                     MonoNs now)
    : context_(context),
      deadline_(now + Timeout(context.settings)),
      command_(command),
      parameter_(parameter),
      reads_before_(true) {}

Procedure::Need OneFrameProcedure::NextNeed(MonoNs now) const {
  if (touched()) return delivered() && NeedsPosition(now) ? Need(Position{}) : Need(Nothing{});
  if (reads_before_ && !(read_ && AtRest(context_.output, now))) return Position{};
  return CommandFrame(command_, context_.settings.node, parameter_);
}

std::optional<Outcome> OneFrameProcedure::On(const Event& event, const Interpreter::Evaluation& evaluation,
                                             MonoNs now) {
  if (!touched()) return OnBefore(evaluation, now);
  acknowledged_ = acknowledged_ || evaluation.acknowledged == command_;
  if (!delivered()) {
    delivery_.On(event, now);
    if (auto failed = NotDelivered(delivery_, context_.settings)) return WithChanges(std::move(*failed));
    if (!delivered()) return std::nullopt;
    deadline_ = now + EffectTimeout();
    if (auto progress = Progress()) return progress;
  }
  return AfterDelivery(event, evaluation, now);
}

std::optional<Outcome> OneFrameProcedure::OnBefore(const Interpreter::Evaluation& evaluation, MonoNs now) {
  if (!reads_before_) return std::nullopt;
  if (evaluation.reading && !evaluation.reading->error) {
    if (!AtRest(context_.output, now)) return NotAtRest(context_.output.MotionAt(now));
    before_ = evaluation.reading->counts;
    if (Result<> here = CheckPosition(before_); !here) return RefusedOutcome(here.error());
    read_ = true;
    return std::nullopt;
  }
  if (now < deadline_) return std::nullopt;
  return Rejected(Reason::REASON_NO_REPLY, "no position came to begin with");
}

Outcome OneFrameProcedure::OnLinkLost() const {
  return touched() ? WithChanges(LinkLostAfter(Check())) : LinkLostBefore();
}

// ---- Zero ----

MonoNs Zero::Due(MonoNs now) const {
  const MonoNs effect_from = context_.interpreter.effect_from();
  return delivered() && now < effect_from ? std::min(effect_from, deadline_) : OneFrameProcedure::Due(now);
}

MonoNs Zero::EffectTimeout() const { return context_.settings.zero_settle + Timeout(context_.settings); }

// The changes of this progress are needed if this process dies: a later reading shows an effect only if the position
// before is known.
std::optional<Outcome> Zero::Progress() const {
  Outcome running;
  running.text = "the command was on the bus; waiting for a position that shows its effect";
  running.progress = 0.5F;
  return WithCounts(std::move(running), "");
}

std::optional<Outcome> Zero::AfterDelivery(const Event&, const Interpreter::Evaluation& evaluation, MonoNs now) {
  const auto& reading = evaluation.reading;
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

Outcome Zero::Verify(std::int64_t counts) const {
  const int bits = context_.settings.format.bits;
  const std::string text =
      "the position was " + PositionText(before_, bits) + " and is " + PositionText(counts, bits);
  const std::string after = std::to_string(counts);
  if (!IsNearZero(counts, context_.settings)) {
    return WithCounts(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                            std::string(ReplyText()) + ", but " + text + ", not 0"),
                      after);
  }
  const bool may_be_position = LooksLikeReply(before_, Command::kZero, context_.settings);
  const char* reply = may_be_position && acknowledged_ ? "what came as its reply may be a position" : ReplyText();
  const ReadBack read_back = {.same_before = SameBefore(), .confirmed = acknowledged_ && !may_be_position};
  return WithCounts(ReadBackOutcome(read_back, text + "; " + reply), after);
}

bool Zero::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(context_.settings.format.bits),
                           context_.settings.counts_per_turn);
}

Outcome Zero::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

// ---- SetDirection ----

std::optional<Outcome> SetDirection::AfterDelivery(const Event&, const Interpreter::Evaluation&, MonoNs now) {
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

Result<> SetDirection::CheckPosition(std::int64_t counts) const {
  return CheckDirectionAt(counts, context_.settings);
}

Outcome SetDirection::WithChanges(Outcome outcome) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), ""});
  return outcome;
}

Result<> CheckDirectionAt(std::int64_t counts, const SaaCanSettings& settings) {
  if (!LooksLikeReply(counts, Command::kDirection, settings)) return {};
  return NotPermitted("the shaft is at " + PositionText(counts, settings.format.bits) +
                      ", which has the bytes of the reply (22 00): turn it a little");
}

// ---- SetPeriod ----

// The first position may come when the old period ends: the measurement begins with it.
std::optional<Outcome> SetPeriod::AfterDelivery(const Event& event, const Interpreter::Evaluation& evaluation,
                                                MonoNs now) {
  if (evaluation.reading && event.received.first > delivered_at()) meter_.Add(event.received.first);
  if (!meter_.done() && now < deadline_) return std::nullopt;
  if (!meter_.done()) {
    return NotReceived(
        CommandState::kIndeterminate,
        Text("the command was on the bus (%s), but too few positions came to measure their period: %s", ReplyText(),
             Check().c_str()));
  }
  const double measured = meter_.MeanMs();
  Outcome outcome =
      meter_.Fits(period_)
          ? Verified(
                Text("a position comes every %.1f ms; this holds until the driver is restarted: put period_ms: "
                     "%lld into the file",
                     measured, InMilliseconds(period_)))
          : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                  Text("%s, but a position comes every %.1f ms, not every %lld ms", ReplyText(), measured,
                       InMilliseconds(period_)));
  const double before = static_cast<double>(context_.settings.period) / static_cast<double>(kMillisecond);
  outcome.changes.push_back({"period_ms", Text("%.1f", before), Text("%.1f", measured)});
  return outcome;
}

std::string SetPeriod::Check() const {
  return Text("read_position after=\"set_period period_ms=%lld\"", InMilliseconds(period_));
}

// ---- StopCyclic ----

std::optional<Outcome> StopCyclic::AfterDelivery(const Event&, const Interpreter::Evaluation& evaluation,
                                                 MonoNs now) {
  if (evaluation.reading && now >= delivered_at() + kSettle) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 std::string(ReplyText()) + ", but the encoder still sends by itself: is stop_byte right?");
  }
  if (now < deadline_) return std::nullopt;
  return Verified(Text("for %lld ms no position came by itself", InMilliseconds(kQuiet)));
}

// ---- ReadPosition ----

ReadPosition::ReadPosition(After after, const OperationContext& context, MonoNs now)
    : after_(after), context_(context), deadline_(now + Timeout(context.settings)) {}

std::optional<Outcome> ReadPosition::On(const Event&, const Interpreter::Evaluation& evaluation, MonoNs now) {
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

// A shaft that turns may have left the place where it was zeroed. A direction does not show at rest. An encoder that
// answers at the present bit rate was not given another one, or does not use it yet.
const char* ReadPosition::Finding(std::int64_t counts, MonoNs now) const {
  if (after_ != After::kZero) return after_ == After::kBitrate ? kNoEffectSeen : kCannotTell;
  return FindingWord(IsNearZero(counts, context_.settings), AtRest(context_.output, now));
}

// ---- ReadPeriod ----

std::optional<Outcome> ReadPeriod::On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) {
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

}  // namespace axlecast::saa_can
