#include "drivers/tformat/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/tformat/operations.h"

namespace axlecast::tformat {
namespace {

// The interval at which an encoder that does not answer is polled, however slow its slots are.
constexpr MonoNs kAskAgain = 50 * kMillisecond;
// The pause before a tag is read again that could not be read because the encoder writes (spec 8.1: 18 ms at most).
constexpr MonoNs kBusyAgain = 2 * kMillisecond;

// Consecutive requests without a single byte of reply, after which only the ENID is requested.
constexpr int kSilent = 2;

Expectation ExpectationOf(const TFormatSettings& settings, const LinkConfig& link) {
  return {.format = settings.format, .encoder_id = settings.encoder_id, .echo = link.echo};
}

MonoNs CharacterTime(const BusConfig& bus) { return bus.simulate ? 0 : bus.link.line.ShortestCharacter(); }

const TFormatSettings& Own(const DeviceConfig& device) {
  return static_cast<const TFormatSettings&>(*device.settings);
}

}  // namespace

TFormatDevice::TFormatDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : CommandDevice(device.settings, Operations(), output),
      settings_(Own(device)),
      interpreter_(settings_, ExpectationOf(settings_, bus.link), CharacterTime(bus), output) {}

Step TFormatDevice::Next(const BusSlot& slot) const {
  const Step step = PlannedStep(slot);
  const auto* exchange = std::get_if<Exchange>(&step.action);
  const bool of_procedure = runner_.busy() && step.priority == Priority::kCommand;
  if (exchange == nullptr || slot.pending == nullptr || (of_procedure && runner_.procedure().exclusive()))
    return step;
  if (silent_ >= kSilent && !of_procedure) return WatchStep(slot);
  return slot.MaySend(*exchange) ? step : OtherStep(slot);
}

// Replaces a request whose reply could be mistaken for a late one, by another request for a position if possible.
Step TFormatDevice::OtherStep(const BusSlot& slot) const {
  const Exchange position = Ask(DataId::kSingleTurn, settings_.timeout);
  return slot.MaySend(position) ? Step{.action = position, .priority = Priority::kLive} : WatchStep(slot);
}

// Tests whether the encoder answers: its ENID never changes, so that a late reply does no harm. If not even ID 1 may be
// requested, an earlier process may have requested it: then a cell is read that this process has probably not read.
Step TFormatDevice::WatchStep(const BusSlot& slot) const {
  if (slot.now < watch_again_) return {.action = Idle{watch_again_}, .priority = Priority::kLive};
  Exchange watch = Ask(DataId::kEncoderId, settings_.timeout);
  if (!slot.MaySend(Ask(DataId::kMultiTurn, settings_.timeout))) {
    watch = AskCell(fresh_cell_, settings_.timeout);
    watch.shape.fresh = true;
  }
  return {.action = watch, .priority = Priority::kLive};
}

Step TFormatDevice::PlannedStep(const BusSlot& slot) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (line_unclear_) return {.action = WaitForIdleLine{settings_.silence}, .priority = Priority::kLive};
  const Procedure* procedure = runner_.Runnable(slot.now);
  if (procedure == nullptr || (slot.reserved && !procedure->exclusive())) return LiveStep(slot);
  const Step step = procedure->Next(slot.now);
  if (procedure->exclusive()) return step;
  const bool transmits = std::holds_alternative<Exchange>(step.action);
  if (transmits && !(slot.poll_due && live_slot_)) return step;
  Step live = LiveStep(slot);
  Idle* idle = std::get_if<Idle>(&live.action);
  if (idle == nullptr) return live;
  if (transmits) return step;
  idle->until = std::min(idle->until, std::get<Idle>(step.action).until);
  return live;
}

Step TFormatDevice::LiveStep(const BusSlot& slot) const {
  const auto ask = [](const Exchange& exchange) { return Step{.action = exchange, .priority = Priority::kLive}; };
  if (!slot.poll_due && slot.now < not_before_) return {.action = Idle{not_before_}, .priority = Priority::kLive};
  if (all_first_ || interpreter_.wants_all()) return ask(Ask(DataId::kAll, settings_.timeout));
  if (const auto cell = interpreter_.identity().WantedCell(); cell && slot.now >= not_before_) {
    return ask(AskCell(*cell, settings_.timeout));
  }
  if (repeat_) return ask(Ask(*repeat_, settings_.timeout));
  if (!slot.poll_due) return {.action = Idle{kNever}, .priority = Priority::kLive};
  return ask(Ask(PlannedId(), settings_.timeout));
}

DataId TFormatDevice::PlannedId() const {
  const bool all = settings_.plan == Plan::kAll || since_all_ + 1 >= settings_.id3_every;
  return all || !interpreter_.identity().accepted() ? DataId::kAll : DataId::kSingleTurn;
}

void TFormatDevice::OnStarted(const Step& step, MonoNs now) {
  runner_.ExpireIfLate(now);
  const Exchange* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return;
  sent_ = RequestId(exchange->request);
  if (exchange->shape.fresh) fresh_cell_ = static_cast<std::uint8_t>((fresh_cell_ + 1) % kEepromCells);
  live_slot_ = runner_.busy() && step.priority == Priority::kCommand;
  runner_.OnStarted(live_slot_);
  if (live_slot_) Report(runner_.procedure().OnStarted(exchange->request, now));
}

void TFormatDevice::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      OnExchange(event);
      break;
    case Event::Kind::kUnexpectedBytes:
    case Event::Kind::kUnsolicited:
      interpreter_.OnStray(event);
      line_unclear_ = true;
      break;
    case Event::Kind::kSilent:
      line_unclear_ = false;
      break;
    case Event::Kind::kLinkUp:
      OnLinkUp(EndOf(event));
      break;
    case Event::Kind::kLinkDown:
      OnLinkDown();
      break;
    default:  // of other kinds of line
      break;
  }
  runner_.ExpireIfLate(EndOf(event));
}

void TFormatDevice::OnExchange(const Event& event) {
  const Answer answer = interpreter_.OnExchange(event);
  sent_.reset();
  line_unclear_ = answer.line_unclear;
  silent_ = answer.error == ErrorKind::kTimeout ? silent_ + 1 : 0;
  const bool watched = answer.asked == DataId::kEncoderId || answer.asked == DataId::kEepromRead;
  watch_again_ = watched ? EndOf(event) + kAskAgain : 0;
  // The reply of another model to ID 3 also shows that the request has arrived.
  const bool arrived = answer.ok() || answer.error == ErrorKind::kWrongIdentity;
  if (arrived && answer.asked == DataId::kAll) {
    all_first_ = false;
    since_all_ = 0;
  }
  if (!interpreter_.answering()) all_first_ = true;
  if (!runner_.TakeInFlight()) return OnLiveAnswer(answer, EndOf(event));
  Report(runner_.procedure().OnAnswer(answer, EndOf(event)));
}

void TFormatDevice::OnLiveAnswer(const Answer& answer, MonoNs end) {
  if (!answer.ok()) {
    const bool again = ++failures_ == 1;
    repeat_.reset();
    if (again && !IsEeprom(answer.asked)) repeat_ = answer.asked;
    not_before_ = again ? 0 : end + kAskAgain;
    return;
  }
  failures_ = 0;
  repeat_.reset();
  not_before_ = answer.reply.busy.value_or(false) ? end + kBusyAgain : 0;
  if (answer.asked == DataId::kSingleTurn) ++since_all_;
}

void TFormatDevice::OnLinkUp(MonoNs now) {
  link_up_ = true;
  fresh_cell_ = static_cast<std::uint8_t>(now / kMillisecond % kEepromCells);
  line_unclear_ = true;
  all_first_ = true;
  silent_ = 0;
  watch_again_ = 0;
  failures_ = 0;
  repeat_.reset();
  not_before_ = 0;
  interpreter_.OnLinkUp(now);
}

void TFormatDevice::OnLinkDown() {
  link_up_ = false;
  interpreter_.OnLinkDown(std::exchange(sent_, std::nullopt));
  runner_.OnLinkLost();
}

void TFormatDevice::Begin(const DriverCommand& command, MonoNs now) {
  if (runner_.Begin(command, link_up_, now)) live_slot_ = false;
}

Result<std::unique_ptr<Procedure>> TFormatDevice::MakeProcedure(const DriverCommand& command, MonoNs) const {
  return tformat::MakeProcedure(command, settings_, output_);
}

Result<> TFormatDevice::CheckState(const DriverCommand& command, MonoNs) const {
  if (!interpreter_.answering()) return DeviceOffline("the encoder does not answer: check its power and its cable");
  if (FindOperation(Operations(), command.operation)->reads_only) return {};
  if (interpreter_.identity().refused()) {
    return Failure("another encoder is connected than configured: see its alarm wrong_identity",
                   command_status_t::REASON_WRONG_IDENTITY);
  }
  if (!interpreter_.identity().accepted()) {
    return DeviceOffline("the encoder's identity is still being read, repeat");
  }
  return CheckAlarms(command.operation, interpreter_.alarms());
}

bool TFormatDevice::Cancel(const CommandId& id, MonoNs) {
  const bool exclusive = runner_.busy() && runner_.procedure().exclusive();
  if (!runner_.Cancel(id)) return false;
  all_first_ = all_first_ || exclusive;
  return true;
}

// A reset sequence that was broken off must not be completed by a later request.
void TFormatDevice::Report(const std::optional<Outcome>& outcome) {
  const bool exclusive = runner_.busy() && runner_.procedure().exclusive();
  if (runner_.Report(outcome) && exclusive && outcome->state != CommandState::kSucceeded) all_first_ = true;
}

}  // namespace axlecast::tformat
