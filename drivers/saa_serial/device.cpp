#include "drivers/saa_serial/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/saa_serial/operations.h"

namespace axlecast::saa_serial {
namespace {

using Reason = command_status_t;
using Want = Procedure::Want;

}  // namespace

SaaDevice::SaaDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      owned_bus_(bus.family_bus),
      bus_(OwnBus(bus)),
      settings_(Own(device)),
      line_(bus.link.line),
      output_(output),
      interpreter_(bus, settings_, output) {}

Step SaaDevice::Next(const BusSlot& turn) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (interpreter_.quiet_needed() > 0) {
    return {.action = WaitForIdleLine{interpreter_.quiet_needed()}, .priority = Priority::kLive};
  }
  const Want want = procedure_ && !Expired(turn.now) ? procedure_->Wants(turn.now) : Want::kNothing;
  if (want == Want::kZero && !turn.reserved) return ZeroStep();
  return bus_.mode == Mode::kTiming ? Stream(turn) : Poll(turn, want);
}

Step SaaDevice::Stream(const BusSlot& turn) const {
  MonoNs until = interpreter_.silent_at();
  if (procedure_) until = std::min({until, procedure_->Due(turn.now), procedure_->touched() ? kNever : begin_by_});
  return {.action = Listen{std::max(until, turn.now)}, .priority = Priority::kLive};
}

Step SaaDevice::Poll(const BusSlot& turn, Want want) const {
  const bool live = turn.poll_due && (want != Want::kReading || live_turn_ || turn.reserved);
  if (live) return {.action = AskPosition(), .priority = Priority::kLive};
  if (want == Want::kReading) return {.action = AskPosition(), .priority = Priority::kCommand};
  const MonoNs until = procedure_ ? procedure_->Due(turn.now) : kNever;
  return {.action = Idle{until}, .priority = Priority::kLive};
}

Exchange SaaDevice::AskPosition() const {
  Exchange exchange;
  exchange.reply_length = LengthRule(settings_.format.bits);
  exchange.reply_begin = &BeginOfReply;
  exchange.shape = ShapeOf(settings_.format);
  exchange.timeout = settings_.timeout + line_.WireTime(kRequestSize + ReplySize(settings_.format.bits));
  if (bus_.mode == Mode::kHandshake) {
    exchange.pulse = Pulse{bus_.clk->index, bus_.clk->low};
  } else {
    exchange.request = Request(settings_.format.address);
  }
  return exchange;
}

Step SaaDevice::ZeroStep() const {
  if (bus_.mode != Mode::kBus) {
    return {.action = Pulse{bus_.clr->index, bus_.clr->low}, .priority = Priority::kCommand};
  }
  return {.action = Exchange{.request = Request(*settings_.zero_command),
                             .reply_length = nullptr,
                             .timeout = line_.WireTime(kRequestSize)},
          .priority = Priority::kCommand};
}

void SaaDevice::OnStarted(const Step& step, MonoNs now) {
  if (Expired(now)) {
    Report(NeverAsked());
  }
  live_turn_ = step.priority == Priority::kCommand;
  const auto* exchange = std::get_if<Exchange>(&step.action);
  zeroing_ =
      procedure_ != nullptr && live_turn_ &&
      (std::holds_alternative<Pulse>(step.action) || (exchange != nullptr && exchange->reply_length == nullptr));
  if (zeroing_) procedure_->OnZeroStarted();
}

void SaaDevice::On(const Event& event) {
  const MonoNs now = EndOf(event);
  switch (event.kind) {
    case Event::Kind::kLinkUp:
      link_up_ = true;
      interpreter_.OnLinkUp(now);
      break;
    case Event::Kind::kLinkDown:
      OnLinkDown(now);
      break;
    default:
      interpreter_.Take(event);
      AdvanceProcedure(event);
      break;
  }
}

void SaaDevice::OnLinkDown(MonoNs now) {
  link_up_ = false;
  interpreter_.OnLinkDown(std::exchange(zeroing_, false), now);
  if (procedure_) Report(procedure_->OnLinkLost());
}

void SaaDevice::AdvanceProcedure(const Event& event) {
  const MonoNs now = EndOf(event);
  const bool exchange = event.kind == Event::Kind::kTimeout || event.kind == Event::Kind::kReply;
  const bool zeroed = zeroing_ && (exchange || event.kind == Event::Kind::kPulsed);
  if (zeroed) {
    zeroing_ = false;
    Report(procedure_->OnZeroed(interpreter_.effect_from()));
  }
  while (const std::optional<Reading> reading = interpreter_.Next()) {
    if (procedure_ && !Expired(now)) Report(procedure_->OnReading(*reading, now));
  }
  if (!procedure_) return;
  if (Expired(now)) {
    Report(NeverAsked());
  } else {
    Report(procedure_->OnTime(now));
  }
}

void SaaDevice::Begin(const DriverCommand& order, MonoNs now) {
  auto made = Admit(order, now);
  if (const Outcome* refused = std::get_if<Outcome>(&made)) return output_.OnOutcome(order.id, *refused);
  procedure_ = std::move(std::get<std::unique_ptr<Procedure>>(made));
  order_ = order.id;
  begin_by_ = order.begin_by;
  live_turn_ = false;
}

Result<> SaaDevice::Validate(const DriverCommand& order, MonoNs now) const {
  return AsResult(RefusalOf(Admit(order, now)));
}

// What is wrong with the order itself comes first: it will not pass.
Made<Procedure> SaaDevice::Admit(const DriverCommand& order, MonoNs now) const {
  auto made = MakeProcedure(order, bus_, settings_, output_, now);
  if (RefusalOf(made)) return made;
  if (auto refusal = RefusalNow(order, now)) return *std::move(refusal);
  return made;
}

std::optional<Outcome> SaaDevice::RefusalNow(const DriverCommand& order, MonoNs now) const {
  if (auto refusal = RefusalToBegin(procedure_ != nullptr, order, now, link_up_)) return refusal;
  if (!interpreter_.answering())
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the encoder is not heard: check its power, its cable and the mode");
  if (order.operation != kZeroName) return std::nullopt;
  return RefusalInMotion(output_.MotionAt(now));
}

bool SaaDevice::Cancel(const CommandId& id, MonoNs) {
  if (!procedure_ || id != order_ || procedure_->touched()) return false;
  procedure_.reset();
  return true;
}

void SaaDevice::Report(const std::optional<Outcome>& outcome) {
  if (!outcome) return;
  output_.OnOutcome(order_, *outcome);
  if (outcome->IsFinal()) procedure_.reset();
}

}  // namespace axlecast::saa_serial
