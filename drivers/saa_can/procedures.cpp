#include "drivers/saa_can/procedures.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

constexpr MonoNs kPatience = 2 * kSecond;
constexpr int kPatiencePeriods = 10;
// By which positions of a shaft at rest differ from each other.
constexpr std::int64_t kFlicker = 16;

// A shaft that is held, and an encoder that takes its time.
constexpr int kMaxLooks = 5;

double Milliseconds(MonoNs time) { return static_cast<double>(time) / static_cast<double>(kMillisecond); }

}  // namespace

void Delivery::Start(const CanFrame& frame) {
  frame_ = frame;
  state_ = State::kStarted;
}

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

MonoNs Patience(const SaaCanSettings& settings) { return std::max(kPatience, kPatiencePeriods * settings.period); }

std::optional<Outcome> NotDelivered(const Delivery& delivery, const SaaCanSettings& settings) {
  if (delivery.state() == Delivery::State::kRefused) {
    return Final(
        CommandState::kFailed, Reason::REASON_NO_REPLY,
        "nothing was done: the controller's queue is full, because no node acknowledges what is sent: check "
        "cable, termination and bit rate");
  }
  if (delivery.state() != Delivery::State::kNotConfirmed) return std::nullopt;
  return Final(
      CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
      Text("no node acknowledged the frame in %lld ms: it may still wait in the controller's queue and act "
           "later; drop it with: sudo ip link set %s down",
           static_cast<long long>(Delivery::kConfirmWithin / kMillisecond), settings.iface.c_str()));
}

Outcome LinkLost(bool sent, const char* look) {
  if (!sent) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
  }
  return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
               std::string("the link was lost after the request and before its effect could be seen: ") + look +
                   " when it is back");
}

Outcome NothingRead(std::string text) {
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, std::move(text));
}

std::string PositionText(std::int64_t counts, int bits) {
  return Text("%.4f deg (counts %lld)", Degrees(counts, bits), static_cast<long long>(counts));
}

bool LooksLikeReply(std::int64_t counts, Command command, const SaaCanSettings& settings) {
  InlineBytes<kMaxCanData> reply{static_cast<std::uint8_t>(command), 0, 0, 0};
  const Position alike = ParsePosition(reply, settings.format);
  if (alike.error != PositionError::kNone) return false;
  return CircularDistance(counts, alike.counts, settings.counts_per_turn) <= kFlicker;
}

bool IsNearZero(std::int64_t counts, const SaaCanSettings& settings) {
  return CircularDistance(counts, 0, settings.counts_per_turn) <= ZeroToleranceCounts(settings.format.bits);
}

bool AtRest(const DeviceOutput& output, MonoNs now) {
  const Motion motion = output.MotionAt(now);
  return motion.known && motion.standstill;
}

std::string IpLinkLine(const std::string& iface, std::int64_t bitrate) {
  return Text("ip link set %s down; ip link set %s up type can bitrate %lld restart-ms 100", iface.c_str(),
              iface.c_str(), static_cast<long long>(bitrate));
}

Zero::Zero(const OperationContext& context, MonoNs now)
    : context_(context), deadline_(now + Patience(context.settings)) {}

Procedure::Want Zero::Wants(MonoNs now) const {
  switch (stage_) {
    case Stage::kReadBefore:
      return Position{};
    case Stage::kSend:
      if (AtRest(context_.output, now)) return CommandFrame(Command::kZero, context_.settings.node);
      return Position{};
    case Stage::kDeliver:
      return Nothing{};
    default:
      return now < context_.interpreter.effect_from() ? Want(Nothing{}) : Want(Position{});
  }
}

MonoNs Zero::Due(MonoNs now) const {
  if (stage_ == Stage::kDeliver) return delivery_.due();
  const MonoNs effect_from = context_.interpreter.effect_from();
  return stage_ == Stage::kVerify && now < effect_from ? std::min(effect_from, deadline_) : deadline_;
}

void Zero::OnStarted(const CanFrame& frame) {
  stage_ = Stage::kDeliver;
  delivery_.Start(frame);
}

std::optional<Outcome> Zero::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (touched() && heard.acknowledged == Command::kZero) acknowledged_ = true;
  switch (stage_) {
    case Stage::kReadBefore:
    case Stage::kSend:
      return OnBefore(heard, now);
    case Stage::kDeliver:
      return OnDelivery(event, now);
    default:
      return OnVerify(heard, now);
  }
}

std::optional<Outcome> Zero::OnBefore(const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading && !heard.reading->error) {
    if (!AtRest(context_.output, now)) return NotAtRest(context_.output.MotionAt(now));
    before_ = heard.reading->counts;
    stage_ = Stage::kSend;
    return std::nullopt;
  }
  if (now < deadline_) return std::nullopt;
  return Rejected(Reason::REASON_NO_REPLY, "no position came to begin with");
}

std::optional<Outcome> Zero::OnDelivery(const Event& event, MonoNs now) {
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, context_.settings)) return WithCounts(std::move(*failed), "");
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  stage_ = Stage::kVerify;
  deadline_ = now + context_.settings.zero_settle + Patience(context_.settings);
  Outcome running;
  running.text = "the command was on the bus; waiting for a position that shows its effect";
  running.progress = 0.5F;
  // Should this process die: what is found afterwards says something only beside what was before.
  return WithCounts(std::move(running), "");
}

std::optional<Outcome> Zero::OnVerify(const Interpreter::Heard& heard, MonoNs now) {
  const auto& reading = heard.reading;
  if (reading && !reading->error && reading->at.first >= context_.interpreter.effect_from()) {
    if (IsNearZero(reading->counts, context_.settings) || ++looks_ >= kMaxLooks) return Judge(reading->counts);
  }
  if (now < deadline_) return std::nullopt;
  return WithCounts(
      Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            "the command was on the bus, but no position came that shows its effect: read_position when "
            "the encoder is heard again"),
      "");
}

Outcome Zero::Judge(std::int64_t counts) const {
  const int bits = context_.settings.format.bits;
  const std::string reply = acknowledged_ ? "its reply came" : "no reply came";
  const std::string text =
      "the position was " + PositionText(before_, bits) + " and is " + PositionText(counts, bits);
  const std::string after = std::to_string(counts);
  if (!IsNearZero(counts, context_.settings)) {
    return WithCounts(
        Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, reply + ", but " + text + ", not 0"), after);
  }
  const bool may_be_position = LooksLikeReply(before_, Command::kZero, context_.settings);
  const std::string heard = may_be_position && acknowledged_ ? "what came as its reply may be a position" : reply;
  const ReadBack read_back = {.same_before = SameBefore(), .confirmed = acknowledged_ && !may_be_position};
  return WithCounts(ReadBackOutcome(read_back, text + "; " + heard), after);
}

bool Zero::SameBefore() const {
  return CannotBeToldApart(before_, 0, ZeroToleranceCounts(context_.settings.format.bits),
                           context_.settings.counts_per_turn);
}

Outcome Zero::OnLinkLost() const {
  return touched() ? WithCounts(LinkLost(true, "read_position after=zero"), "") : LinkLost(false, "");
}

Outcome Zero::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

// ---- SetDirection ----

SetDirection::SetDirection(std::uint8_t parameter, const OperationContext& context, MonoNs now)
    : parameter_(parameter), context_(context), deadline_(now + Patience(context.settings)) {}

Procedure::Want SetDirection::Wants(MonoNs now) const {
  if (touched()) return Nothing{};
  if (!read_ || !AtRest(context_.output, now)) return Position{};
  return CommandFrame(Command::kDirection, context_.settings.node, parameter_);
}

MonoNs SetDirection::Due(MonoNs) const {
  switch (delivery_.state()) {
    case Delivery::State::kIdle:
      return deadline_;
    case Delivery::State::kOnBus:
      return delivery_.on_bus_at() + context_.settings.reply_window;
    default:
      return delivery_.due();
  }
}

void SetDirection::OnStarted(const CanFrame& frame) { delivery_.Start(frame); }

std::optional<Outcome> SetDirection::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return OnBefore(heard, now);
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, context_.settings)) return WithCounts(std::move(*failed), "");
  if (heard.acknowledged == Command::kDirection) {
    return WithCounts(Succeeded(false,
                                "the encoder accepted it; nothing can be read back at rest: turn the shaft a "
                                "little and see which way it counts, then reference again"),
                      "");
  }
  if (delivery_.state() != Delivery::State::kOnBus || now < Due(now)) return std::nullopt;
  return WithCounts(
      Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
            "the command was on the bus, but no reply came: turn the shaft a little and see which way "
            "it counts"),
      "");
}

std::optional<Outcome> SetDirection::OnBefore(const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading && !heard.reading->error) {
    before_ = heard.reading->counts;
    read_ = true;
    if (!AtRest(context_.output, now)) return NotAtRest(context_.output.MotionAt(now));
    if (Result<> here = CheckDirectionAt(before_, context_.settings); !here) return RefusedOutcome(here.error());
    return std::nullopt;
  }
  if (now < deadline_) return std::nullopt;
  return Rejected(Reason::REASON_NO_REPLY, "no position came to begin with");
}

Outcome SetDirection::OnLinkLost() const {
  return touched() ? WithCounts(LinkLost(true, "turn the shaft and see which way it counts"), "")
                   : LinkLost(false, "");
}

Outcome SetDirection::WithCounts(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"single_turn", std::to_string(before_), after});
  return outcome;
}

Result<> CheckDirectionAt(std::int64_t counts, const SaaCanSettings& settings) {
  if (!LooksLikeReply(counts, Command::kDirection, settings)) return {};
  return NotPermitted("the shaft is at " + PositionText(counts, settings.format.bits) +
                      ", which has the bytes of the reply (22 00): turn it a little");
}

// ---- SetPeriod ----

SetPeriod::SetPeriod(std::uint8_t per_second, const OperationContext& context)
    : per_second_(per_second), context_(context) {}

Procedure::Want SetPeriod::Wants(MonoNs) const {
  if (touched()) return Nothing{};
  return CommandFrame(Command::kPeriod, context_.settings.node, per_second_);
}

MonoNs SetPeriod::Due(MonoNs) const {
  return delivery_.state() == Delivery::State::kOnBus ? deadline_ : delivery_.due();
}

std::optional<Outcome> SetPeriod::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return std::nullopt;
  const bool was_on_bus = delivery_.state() == Delivery::State::kOnBus;
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, context_.settings)) return failed;
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  if (!was_on_bus) deadline_ = now + PeriodMeter::Patience(std::max(period(), context_.interpreter.period()));
  acknowledged_ = acknowledged_ || heard.acknowledged == Command::kPeriod;
  // The first one may come when the old period ends: what is measured begins with it.
  if (heard.reading && event.received.first > delivery_.on_bus_at()) meter_.Add(event.received.first);
  if (!meter_.done() && now < deadline_) return std::nullopt;
  return Judge();
}

Outcome SetPeriod::Judge() const {
  const char* reply = acknowledged_ ? "its reply came" : "no reply came";
  const auto nominal = static_cast<long long>(period() / kMillisecond);
  if (!meter_.done()) {
    return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                 Text("the command was on the bus (%s), but too few positions came to measure their period: "
                      "read_position after=\"set_period period_ms=%lld\"",
                      reply, nominal));
  }
  const bool fits = meter_.Fits(period());
  const double measured = Milliseconds(meter_.Mean());
  Outcome outcome =
      fits ? Verified(Text("a position comes every %.1f ms; until the driver is restarted it goes by that: put "
                           "period_ms: %lld into the file",
                           measured, nominal))
           : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                   Text("%s, but a position comes every %.1f ms, not every %lld ms", reply, measured, nominal));
  outcome.changes.push_back(
      {"period_ms", Text("%.1f", Milliseconds(context_.settings.period)), Text("%.1f", measured)});
  return outcome;
}

Outcome SetPeriod::LinkLostText() const {
  const std::string look =
      Text("read_position after=\"set_period period_ms=%lld\"", static_cast<long long>(period() / kMillisecond));
  return LinkLost(touched(), look.c_str());
}

// ---- StopCyclic ----

Procedure::Want StopCyclic::Wants(MonoNs) const {
  if (touched()) return Nothing{};
  return CommandFrame(Command::kPeriod, context_.settings.node, parameter_);
}

MonoNs StopCyclic::Due(MonoNs) const {
  return delivery_.state() == Delivery::State::kOnBus ? delivery_.on_bus_at() + kSettle + kQuiet : delivery_.due();
}

std::optional<Outcome> StopCyclic::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return std::nullopt;
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, context_.settings)) return failed;
  acknowledged_ = acknowledged_ || heard.acknowledged == Command::kPeriod;
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  if (heard.reading && now >= delivery_.on_bus_at() + kSettle) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 Text("%s, but the encoder still sends by itself: is stop_byte right?",
                      acknowledged_ ? "its reply came" : "no reply came"));
  }
  if (now < Due(now)) return std::nullopt;
  return Verified(Text("for %lld ms no position came by itself", static_cast<long long>(kQuiet / kMillisecond)));
}

Outcome StopCyclic::OnLinkLost() const { return LinkLost(touched(), "see whether positions come by themselves"); }

// ---- ReadPosition ----

ReadPosition::ReadPosition(After after, const OperationContext& context, MonoNs now)
    : after_(after), context_(context), deadline_(now + Patience(context.settings)) {}

std::optional<Outcome> ReadPosition::On(const Event&, const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading && !heard.reading->error) {
    const std::int64_t counts = heard.reading->counts;
    Outcome outcome = Verified("the position is " + PositionText(counts, context_.settings.format.bits));
    outcome.changes.push_back({"single_turn", "", std::to_string(counts)});
    if (after_ != After::kNothing) outcome.changes.push_back(FindingChange(Finding(counts, now)));
    return outcome;
  }
  if (now < deadline_) return std::nullopt;
  return NothingRead("no position came in time");
}

// A shaft that turns may have left the place where it was zeroed; a direction does not show at rest; an encoder that is
// heard at the present bit rate was not given another one, or has not taken it up yet.
const char* ReadPosition::Finding(std::int64_t counts, MonoNs now) const {
  if (after_ != After::kZero) return after_ == After::kBitrate ? kNoEffectSeen : kCannotTell;
  if (IsNearZero(counts, context_.settings)) return kReadsAsAfter;
  return AtRest(context_.output, now) ? kNoEffectSeen : kCannotTell;
}

Outcome ReadPosition::OnLinkLost() const { return NothingRead("the link was lost before a position came"); }

// ---- LookForPeriod ----

LookForPeriod::LookForPeriod(MonoNs period, const OperationContext& context, MonoNs now)
    : period_(period), deadline_(now + PeriodMeter::Patience(std::max(period, context.interpreter.period()))) {}

std::optional<Outcome> LookForPeriod::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (heard.reading) meter_.Add(event.received.first);
  if (!meter_.done() && now < deadline_) return std::nullopt;
  if (!meter_.done()) return NothingRead("too few positions came to measure their period");
  const double measured = static_cast<double>(meter_.Mean()) / static_cast<double>(kMillisecond);
  Outcome outcome = Verified(Text("a position comes every %.1f ms", measured));
  outcome.changes.push_back({"period_ms", "", Text("%.1f", measured)});
  outcome.changes.push_back(FindingChange(FindingWord(meter_.Fits(period_))));
  return outcome;
}

Outcome LookForPeriod::OnLinkLost() const {
  return NothingRead("the link was lost before the period was measured");
}

}  // namespace axlecast::saa_can
