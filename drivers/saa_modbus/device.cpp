#include "drivers/saa_modbus/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>
#include <variant>

#include "core/device/operation.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

const SaaModbusSettings& Own(const DeviceConfig& device) {
  return static_cast<const SaaModbusSettings&>(*device.settings);
}

// A simulated wire may be faster than a real one.
LineFormat WireOf(const BusConfig& bus) { return bus.simulate ? LineFormat{} : bus.link.line; }

std::vector<std::uint8_t> OtherAddresses(const BusConfig& bus, const DeviceConfig& own) {
  std::vector<std::uint8_t> addresses;
  for (const DeviceConfig& device : bus.devices) {
    if (device.name != own.name) addresses.push_back(Own(device).address);
  }
  return addresses;
}

}  // namespace

SaaModbusDevice::SaaModbusDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
    : owned_(device.settings),
      settings_(Own(device)),
      line_(bus.link.line),
      keeps_line_(bus.devices.empty() || bus.devices.front().name == device.name),
      other_addresses_(OtherAddresses(bus, device)),
      output_(output),
      connection_{.address = settings_.address, .baud = line_.baud, .port_baud = line_.baud},
      around_{settings_, output_, connection_, other_addresses_},
      interpreter_(settings_, WireOf(bus), connection_, output) {}

Step SaaModbusDevice::Next(const BusSlot& turn) const {
  const auto idle = [](MonoNs until) { return Step{.action = Idle{until}, .priority = Priority::kLive}; };
  if (!link_up_) return idle(kNever);
  if (line_unclear_) return {.action = WaitForIdleLine{Patience()}, .priority = Priority::kLive};
  if (turn.now < not_before_) return idle(not_before_);
  // An order that has begun is not interrupted: it may change the address or the rate, and it takes readings itself.
  if (!procedure_ || Expired(turn.now) || (turn.reserved && !procedure_begun_)) return LiveStep(turn);
  return CarryOut(procedure_->Next(turn.now), turn);
}

Step SaaModbusDevice::LiveStep(const BusSlot& turn) const {
  if (connection_.port_baud != connection_.baud) {
    return {.action = SetBaudRate{connection_.baud}, .priority = Priority::kLive};
  }
  if (!turn.poll_due && !repeat_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  return Read(connection_.address, turn, Priority::kLive);
}

Step SaaModbusDevice::CarryOut(const Want& want, const BusSlot& turn) const {
  if (const auto* wait = std::get_if<WaitUntil>(&want)) {
    return {.action = Idle{wait->until}, .priority = Priority::kCommand};
  }
  if (const auto* read = std::get_if<ReadAt>(&want)) return Read(read->address, turn, Priority::kCommand);
  if (const auto* port = std::get_if<PortBaud>(&want)) {
    return {.action = SetBaudRate{port->baud}, .priority = Priority::kCommand};
  }
  return {.action = Ask(std::get<Send>(want).request), .priority = Priority::kCommand};
}

Step SaaModbusDevice::Read(std::uint8_t address, const BusSlot& turn, Priority priority) const {
  const Exchange usual = Ask(ReadRequest(address, settings_.registers));
  if (turn.MaySend(usual) || settings_.bits > kOneRegisterBits) return {.action = usual, .priority = priority};
  const Exchange other = Ask(ReadRequest(address, 3 - settings_.registers));
  return {.action = turn.MaySend(other) ? other : usual, .priority = priority};
}

Exchange SaaModbusDevice::Ask(const Frame& request) const {
  Exchange exchange{.request = request, .reply_length = &ReplyLength, .timeout = Patience()};
  exchange.shape = ReplyShapeOf(request);
  return exchange;
}

// At a slower rate than the file's an exchange takes longer.
MonoNs SaaModbusDevice::Patience() const {
  LineFormat present = line_;
  present.baud = connection_.port_baud;
  return settings_.timeout + std::max<MonoNs>(0, LongestExchange(present) - LongestExchange(line_));
}

void SaaModbusDevice::OnStarted(const Step& step, MonoNs now) {
  ExpireIfLate(now);
  if (const auto* retune = std::get_if<SetBaudRate>(&step.action)) {
    tuning_to_ = retune->baud;
    procedure_begun_ = procedure_begun_ || step.priority == Priority::kCommand;
    return;
  }
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return;
  sent_ = exchange->request;
  const std::optional<Request> asked = ParseRequest(sent_);
  if (asked && asked->writes()) last_write_ = now;
  procedure_in_flight_ = procedure_ != nullptr && step.priority == Priority::kCommand;
  if (!procedure_in_flight_) return;
  procedure_begun_ = true;
  if (const auto outcome = procedure_->OnStarted(exchange->request, now)) Report(*outcome);
}

void SaaModbusDevice::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      OnExchange(event);
      break;
    case Event::Kind::kUnexpectedBytes:
    case Event::Kind::kUnsolicited:
      OnStray(event);
      break;
    case Event::Kind::kSilent:
      line_unclear_ = false;
      break;
    case Event::Kind::kBaudRateSet:
      OnRetuned(EndOf(event));
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
  ExpireIfLate(EndOf(event));
}

void SaaModbusDevice::OnExchange(const Event& event) {
  const MonoNs end = EndOf(event);
  const Answer answer = interpreter_.OnExchange(event);
  sent_.Clear();
  line_unclear_ = answer.unanswered || answer.error == ErrorKind::kChecksum;
  LineFormat present = line_;
  present.baud = connection_.port_baud;
  if (present.baud != line_.baud) not_before_ = end + SilentInterval(present);
  if (!std::exchange(procedure_in_flight_, false)) {
    failures_ = answer.ok() ? 0 : failures_ + 1;
    repeat_ = failures_ == 1;
  } else if (const auto outcome = procedure_->OnAnswer(answer, end)) {
    Report(*outcome);
  }
  CompareWithFile(end);
}

// Every device of the bus is told of it: one of them counts it and keeps the line quiet.
void SaaModbusDevice::OnStray(const Event& event) {
  if (!keeps_line_) return;
  output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
  line_unclear_ = true;
}

void SaaModbusDevice::OnRetuned(MonoNs now) {
  connection_.port_baud = tuning_to_;
  if (procedure_) procedure_->OnRetuned(now);
}

void SaaModbusDevice::OnLinkUp(MonoNs now) {
  link_up_ = true;
  line_unclear_ = keeps_line_;
  repeat_ = false;
  failures_ = 0;
  not_before_ = now;
  connection_.port_baud = line_.baud;  // a port is opened as the file says
  output_.OnStarting("no answer yet");
}

void SaaModbusDevice::OnLinkDown() {
  link_up_ = false;
  procedure_in_flight_ = false;
  interpreter_.OnLost(sent_);
  sent_.Clear();
  interpreter_.OnLinkDown();
  if (procedure_) Report(procedure_->OnLinkLost());
}

void SaaModbusDevice::CompareWithFile(MonoNs now) {
  const bool differs = connection_.address != settings_.address || connection_.baud != line_.baud;
  if (differs == differs_) return;
  differs_ = differs;
  output_.OnAlarm(kConfigurationDiffers, differs ? AlarmState::kLive : AlarmState::kAbsent, now);
}

// ---- orders ----

void SaaModbusDevice::Begin(const DriverCommand& order, MonoNs now) {
  auto made = Admit(order, now);
  if (const Outcome* refused = std::get_if<Outcome>(&made)) return output_.OnOutcome(order.id, *refused);
  procedure_ = std::move(std::get<std::unique_ptr<Procedure>>(made));
  order_ = order.id;
  begin_by_ = order.begin_by;
  procedure_begun_ = false;
}

Result<> SaaModbusDevice::Validate(const DriverCommand& order, MonoNs now) const {
  return AsResult(RefusalOf(Admit(order, now)));
}

// What is wrong with the order itself comes first: it will not pass.
Made<Procedure> SaaModbusDevice::Admit(const DriverCommand& order, MonoNs now) const {
  auto made = MakeProcedure(order, around_);
  if (RefusalOf(made)) return made;
  if (auto refusal = RefusalNow(order, now)) return *std::move(refusal);
  return made;
}

std::optional<Outcome> SaaModbusDevice::RefusalNow(const DriverCommand& order, MonoNs now) const {
  if (auto refusal = RefusalToBegin(procedure_ != nullptr, order, now, link_up_)) return refusal;
  if (!interpreter_.answering() && !LooksElsewhere(order)) {
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the encoder does not answer: check its power, its cable, address and baud");
  }
  const OperationSpec* operation = FindOperation(order.operation);
  if (operation == nullptr || !Writes(order.operation)) return std::nullopt;
  return RefusalOfWrite(*operation, now);
}

std::optional<Outcome> SaaModbusDevice::RefusalOfWrite(const OperationSpec& operation, MonoNs now) const {
  const MonoNs wait = last_write_ ? *last_write_ + settings_.write_interval - now : 0;
  if (wait > 0) {
    return Rejected(
        Reason::REASON_WEAR,
        Text("the maker warns of writing regularly: one write in %lld s (write_interval_s); repeat it in "
             "%.1f s",
             static_cast<long long>(settings_.write_interval / kSecond),
             static_cast<double>(wait) / static_cast<double>(kSecond)));
  }
  if (!operation.needs_standstill) return std::nullopt;
  return RefusalInMotion(output_.MotionAt(now));
}

bool SaaModbusDevice::Cancel(const CommandId& id, MonoNs) {
  if (!procedure_ || id != order_ || procedure_->touched()) return false;
  procedure_.reset();
  procedure_in_flight_ = false;
  return true;
}

void SaaModbusDevice::ExpireIfLate(MonoNs now) {
  if (!procedure_ || !Expired(now)) return;
  Report(NeverAsked());
}

void SaaModbusDevice::Report(const Outcome& outcome) {
  output_.OnOutcome(order_, outcome);
  if (!outcome.IsFinal()) return;
  procedure_.reset();
  procedure_in_flight_ = false;
}

}  // namespace axlecast::saa_modbus
