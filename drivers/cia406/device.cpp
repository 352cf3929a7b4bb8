#include "drivers/cia406/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/operations.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Reason = command_status_t;

// A full queue empties within some frames, or not at all while nobody acknowledges.
constexpr MonoNs kQueueFull = 100 * kMillisecond;
// SYNC on a bus where nobody is heard.
constexpr MonoNs kIdleSync = 200 * kMillisecond;

}  // namespace

Cia406Device::Cia406Device(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      settings_(Own(device)),
      produces_sync_(ProducesSync(bus, device)),
      output_(output),
      interpreter_(bus, device, output) {}

// ---- wishes ----

Step Cia406Device::Next(const BusSlot& turn) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (turn.now < hold_until_) return {.action = Listen{hold_until_}, .priority = Priority::kLive};
  if (SyncIsDue(turn)) return {.action = Send{SyncFrame()}, .priority = Priority::kLive};
  if (const auto urgent = interpreter_.UrgentFrame(turn.now)) {
    return {.action = Send{*urgent}, .priority = Priority::kCommand};
  }
  const std::optional<Transfer> transfer = NextTransfer(turn);
  if (!transfer) return Listening(turn.now);
  return {.action = Send{RequestFrame(settings_.node, transfer->request)}, .priority = transfer->priority};
}

bool Cia406Device::SyncIsDue(const BusSlot& turn) const {
  if (!produces_sync_ || !turn.poll_due) return false;
  return interpreter_.BusIsAlive(turn.now) || turn.now - sync_at_ >= kIdleSync;
}

std::optional<Cia406Device::Transfer> Cia406Device::NextTransfer(const BusSlot& turn) const {
  if (!interpreter_.client().free()) return std::nullopt;
  const auto reading = [](ObjectId object, Priority priority) {
    return Transfer{.request = {.object = object, .write = {}}, .priority = priority};
  };
  if (const auto first = interpreter_.FirstObject(turn.now)) return reading(*first, Priority::kSlow);
  if (interpreter_.client().fence() || !interpreter_.running()) return std::nullopt;
  const bool live = settings_.mode == Mode::kPolled && turn.poll_due;
  const std::optional<SdoRequest> ordered = Ordered(turn.now);
  if (ordered && (!live || !live_turn_)) return Transfer{*ordered, Priority::kCommand};
  if (live) return reading(kPosition, Priority::kLive);
  if (const auto diagnostic = interpreter_.DiagnosticObject(turn.now)) return reading(*diagnostic, Priority::kSlow);
  return std::nullopt;
}

std::optional<SdoRequest> Cia406Device::Ordered(MonoNs now) const {
  if (!procedure_ || Expired(now)) return std::nullopt;
  return procedure_->Wants(now);
}

Step Cia406Device::Listening(MonoNs now) const {
  MonoNs until = interpreter_.Due(now);
  if (procedure_) until = std::min({until, procedure_->Due(now), procedure_->touched() ? kNever : begin_by_});
  return {.action = Listen{std::max(until, now)}, .priority = Priority::kLive};
}

// ---- events ----

void Cia406Device::OnStarted(const Step& step, MonoNs now) {
  for_order_ = false;
  const auto* send = std::get_if<Send>(&step.action);
  if (send == nullptr) return;
  if (send->frame.id == kSyncId) {
    sync_at_ = now;
    return;
  }
  live_turn_ = step.priority == Priority::kCommand;
  const std::optional<SdoRequest> ordered = Ordered(now);
  if (!live_turn_ || !ordered || send->frame.id != kSdoRequestId + settings_.node) return;
  const std::optional<SdoRequest> request = ParseRequest(send->frame.data);
  for_order_ = request && request->object == ordered->object && request->write == ordered->write;
  if (for_order_) procedure_->OnStarted(*ordered, now);
}

void Cia406Device::On(const Event& event) {
  const MonoNs now = event.received.last;
  switch (event.kind) {
    case Event::Kind::kLinkUp:
      link_up_ = true;
      hold_until_ = 0;
      interpreter_.OnLinkUp(now);
      break;
    case Event::Kind::kLinkDown:
      OnLinkDown(now);
      break;
    default:
      if (event.kind == Event::Kind::kNotSent) OnNotSent(event);
      AdvanceProcedure(interpreter_.Take(event), now);
      break;
  }
}

void Cia406Device::OnLinkDown(MonoNs now) {
  link_up_ = false;
  for_order_ = false;
  interpreter_.OnLinkDown(now);
  if (procedure_) Report(procedure_->OnLinkLost());
}

// The queue is the controller's: whoever's frame it was, the next would not fit either.
void Cia406Device::OnNotSent(const Event& event) {
  hold_until_ = event.received.last + kQueueFull;
  if (std::exchange(for_order_, false) && procedure_) procedure_->OnNotSent();
}

void Cia406Device::AdvanceProcedure(const std::optional<SdoResult>& result, MonoNs now) {
  if (procedure_ && Expired(now)) {
    return Report(NeverAsked());
  }
  if (procedure_ && result) Report(procedure_->OnResult(*result));
  if (procedure_) Report(procedure_->OnTime(now));
}

// ---- orders ----

void Cia406Device::Begin(const DriverCommand& order, MonoNs now) {
  auto made = Admit(order, now);
  if (const Outcome* refused = std::get_if<Outcome>(&made)) return output_.OnOutcome(order.id, *refused);
  procedure_ = std::move(std::get<std::unique_ptr<Procedure>>(made));
  order_ = order.id;
  begin_by_ = order.begin_by;
  live_turn_ = false;
}

Result<> Cia406Device::Validate(const DriverCommand& order, MonoNs now) const {
  return AsResult(RefusalOf(Admit(order, now)));
}

// What is wrong with the order itself comes first: it will not pass.
Made<Procedure> Cia406Device::Admit(const DriverCommand& order, MonoNs now) const {
  auto made = MakeProcedure(order, settings_, interpreter_, output_, now);
  if (RefusalOf(made)) return made;
  if (auto refusal = RefusalNow(order, now)) return *std::move(refusal);
  return made;
}

std::optional<Outcome> Cia406Device::RefusalNow(const DriverCommand& order, MonoNs now) const {
  if (auto refusal = RefusalToBegin(procedure_ != nullptr, order, now, link_up_)) return refusal;
  if (!interpreter_.running()) {
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the encoder is not heard, or not identified yet: check its power, its cable and node id");
  }
  if (!MovesDatum(order.operation)) return std::nullopt;
  return RefusalInMotion(output_.MotionAt(now));
}

bool Cia406Device::Cancel(const CommandId& id, MonoNs) {
  if (!procedure_ || id != order_ || procedure_->touched()) return false;
  procedure_.reset();
  for_order_ = false;
  return true;
}

void Cia406Device::Report(const std::optional<Outcome>& outcome) {
  if (!outcome) return;
  output_.OnOutcome(order_, *outcome);
  if (outcome->IsFinal()) procedure_.reset();
}

}  // namespace axlecast::cia406
