#include "drivers/saa_can/setting.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_can/ending.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

double Milliseconds(MonoNs time) { return static_cast<double>(time) / static_cast<double>(kMillisecond); }

}  // namespace

// ---- SetDirection ----

SetDirection::SetDirection(std::uint8_t parameter, const OperationContext& around, MonoNs now)
    : parameter_(parameter), around_(around), deadline_(now + Patience(around.settings)) {}

Procedure::Want SetDirection::Wants(MonoNs now) const {
  if (touched()) return Nothing{};
  if (!read_ || !AtRest(around_.output, now)) return Position{};
  return CommandFrame(Command::kDirection, around_.settings.node, parameter_);
}

MonoNs SetDirection::Due(MonoNs) const {
  switch (delivery_.state()) {
    case Delivery::State::kIdle:
      return deadline_;
    case Delivery::State::kOnBus:
      return delivery_.on_bus_at() + around_.settings.reply_window;
    default:
      return delivery_.due();
  }
}

void SetDirection::OnStarted(const CanFrame& frame) { delivery_.Start(frame); }

std::optional<Outcome> SetDirection::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return OnBefore(heard, now);
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, around_.settings)) return WithCounts(std::move(*failed), "");
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
    if (!AtRest(around_.output, now)) {
      return Rejected(Reason::REASON_NOT_STANDING_STILL, MotionText(around_.output.MotionAt(now)));
    }
    return RefusalOfDirectionAt(before_, around_.settings);
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

std::optional<Outcome> RefusalOfDirectionAt(std::int64_t counts, const SaaCanSettings& settings) {
  if (!LooksLikeReply(counts, Command::kDirection, settings)) return std::nullopt;
  return Rejected(Reason::REASON_NOT_PERMITTED, "the shaft stands at " +
                                                    PositionText(counts, settings.format.bits) +
                                                    ", which has the bytes of the reply (22 00): turn it a little");
}

// ---- SetPeriod ----

SetPeriod::SetPeriod(std::uint8_t per_second, const OperationContext& around)
    : per_second_(per_second), around_(around) {}

Procedure::Want SetPeriod::Wants(MonoNs) const {
  if (touched()) return Nothing{};
  return CommandFrame(Command::kPeriod, around_.settings.node, per_second_);
}

MonoNs SetPeriod::Due(MonoNs) const {
  return delivery_.state() == Delivery::State::kOnBus ? deadline_ : delivery_.due();
}

std::optional<Outcome> SetPeriod::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return std::nullopt;
  const bool was_on_bus = delivery_.state() == Delivery::State::kOnBus;
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, around_.settings)) return failed;
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  if (!was_on_bus) deadline_ = now + PeriodMeter::Patience(std::max(period(), around_.interpreter.period()));
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
      {"period_ms", Text("%.1f", Milliseconds(around_.settings.period)), Text("%.1f", measured)});
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
  return CommandFrame(Command::kPeriod, around_.settings.node, parameter_);
}

MonoNs StopCyclic::Due(MonoNs) const {
  return delivery_.state() == Delivery::State::kOnBus ? delivery_.on_bus_at() + kSettle + kQuiet : delivery_.due();
}

std::optional<Outcome> StopCyclic::On(const Event& event, const Interpreter::Heard& heard, MonoNs now) {
  if (!touched()) return std::nullopt;
  delivery_.On(event, now);
  if (auto failed = NotDelivered(delivery_, around_.settings)) return failed;
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

}  // namespace axlecast::saa_can
