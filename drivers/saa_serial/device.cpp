#include "drivers/saa_serial/device.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/saa_serial/operations.h"

namespace axlecast::saa_serial {
namespace {

using Want = Procedure::Want;

}  // namespace

SaaDevice::SaaDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      owned_bus_(bus.family_bus),
      bus_(OwnBus(bus)),
      settings_(Own(device)),
      line_(bus.link.line),
      output_(output),
      interpreter_(bus, settings_, output),
      runner_(Operations(), *this, output) {}

Step SaaDevice::Next(const BusSlot& turn) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (interpreter_.quiet_needed() > 0) {
    return {.action = WaitForIdleLine{interpreter_.quiet_needed()}, .priority = Priority::kLive};
  }
  const Procedure* procedure = runner_.Runnable(turn.now);
  const Want want = procedure != nullptr ? procedure->Wants(turn.now) : Want::kNothing;
  if (want == Want::kZero && !turn.reserved) return ZeroStep();
  return bus_.mode == Mode::kTiming ? Stream(turn) : Poll(turn, want);
}

Step SaaDevice::Stream(const BusSlot& turn) const {
  MonoNs until = interpreter_.silent_at();
  if (runner_.busy()) until = std::min({until, runner_.procedure().Due(turn.now), runner_.ExpiresAt()});
  return {.action = Listen{std::max(until, turn.now)}, .priority = Priority::kLive};
}

Step SaaDevice::Poll(const BusSlot& turn, Want want) const {
  const bool live = turn.poll_due && (want != Want::kReading || live_slot_ || turn.reserved);
  if (live) return {.action = AskPosition(), .priority = Priority::kLive};
  if (want == Want::kReading) return {.action = AskPosition(), .priority = Priority::kCommand};
  const MonoNs until = runner_.busy() ? runner_.procedure().Due(turn.now) : kNever;
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
  runner_.ExpireIfLate(now);
  live_slot_ = step.priority == Priority::kCommand;
  const auto* exchange = std::get_if<Exchange>(&step.action);
  zeroing_ =
      runner_.busy() && live_slot_ &&
      (std::holds_alternative<Pulse>(step.action) || (exchange != nullptr && exchange->reply_length == nullptr));
  if (zeroing_) runner_.procedure().OnZeroStarted();
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
  runner_.OnLinkLost();
}

void SaaDevice::AdvanceProcedure(const Event& event) {
  const MonoNs now = EndOf(event);
  const bool exchange = event.kind == Event::Kind::kTimeout || event.kind == Event::Kind::kReply;
  const bool zeroed = zeroing_ && (exchange || event.kind == Event::Kind::kPulsed);
  if (zeroed) {
    zeroing_ = false;
    runner_.Report(runner_.procedure().OnZeroed(interpreter_.effect_from()));
  }
  while (const std::optional<Reading> reading = interpreter_.Next()) {
    if (Procedure* procedure = runner_.Runnable(now)) runner_.Report(procedure->OnReading(*reading, now));
  }
  if (runner_.ExpireIfLate(now) || !runner_.busy()) return;
  runner_.Report(runner_.procedure().OnTime(now));
}

void SaaDevice::Begin(const DriverCommand& command, MonoNs now) {
  if (runner_.Begin(command, link_up_, now)) live_slot_ = false;
}

Result<std::unique_ptr<Procedure>> SaaDevice::MakeProcedure(const DriverCommand& command, MonoNs now) const {
  return saa_serial::MakeProcedure(command, bus_, settings_, output_, now);
}

Result<> SaaDevice::CheckState(const DriverCommand&, MonoNs) const {
  if (interpreter_.answering()) return {};
  return DeviceOffline("nothing is received from the encoder: check its power, its cable and the mode");
}

}  // namespace axlecast::saa_serial
