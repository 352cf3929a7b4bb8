#include "drivers/saa_modbus/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
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
      context_{settings_, output_, connection_, other_addresses_},
      interpreter_(settings_, WireOf(bus), connection_, output),
      runner_(Operations(), *this, output) {}

Step SaaModbusDevice::Next(const BusSlot& slot) const {
  const auto idle = [](MonoNs until) { return Step{.action = Idle{until}, .priority = Priority::kLive}; };
  if (!link_up_) return idle(kNever);
  if (line_unclear_) return {.action = WaitForIdleLine{Timeout()}, .priority = Priority::kLive};
  if (slot.now < not_before_) return idle(not_before_);
  // A command that has begun is not interrupted: it may change the address or the rate, and it takes readings itself.
  const Procedure* procedure = runner_.Runnable(slot.now);
  if (procedure == nullptr || (slot.reserved && !runner_.HasBegun())) return LiveStep(slot);
  return CarryOut(procedure->Next(slot.now), slot);
}

Step SaaModbusDevice::LiveStep(const BusSlot& slot) const {
  if (connection_.port_baud != connection_.baud) {
    return {.action = SetBaudRate{connection_.baud}, .priority = Priority::kLive};
  }
  if (!slot.poll_due && !repeat_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  return Read(connection_.address, slot, Priority::kLive);
}

Step SaaModbusDevice::CarryOut(const ProcedureStep& step, const BusSlot& slot) const {
  const auto command = [](auto action) { return Step{.action = action, .priority = Priority::kCommand}; };
  if (const auto* read = std::get_if<ReadAt>(&step)) return Read(read->address, slot, Priority::kCommand);
  if (const auto* request = std::get_if<Frame>(&step)) return command(ExchangeOf(*request));
  if (const auto* baud = std::get_if<SetBaudRate>(&step)) return command(*baud);
  return command(std::get<Idle>(step));
}

Step SaaModbusDevice::Read(std::uint8_t address, const BusSlot& slot, Priority priority) const {
  const Exchange usual = ExchangeOf(ReadRequest(address, settings_.registers));
  if (slot.MaySend(usual) || settings_.bits > kOneRegisterBits) return {.action = usual, .priority = priority};
  const Exchange other = ExchangeOf(ReadRequest(address, 3 - settings_.registers));
  return {.action = slot.MaySend(other) ? other : usual, .priority = priority};
}

Exchange SaaModbusDevice::ExchangeOf(const Frame& request) const {
  Exchange exchange{.request = request, .reply_length = &ReplyLength, .timeout = Timeout()};
  exchange.shape = ReplyShapeOf(request);
  return exchange;
}

// At a slower rate than the file's an exchange takes longer.
MonoNs SaaModbusDevice::Timeout() const {
  LineFormat present = line_;
  present.baud = connection_.port_baud;
  return settings_.timeout + std::max<MonoNs>(0, LongestExchange(present) - LongestExchange(line_));
}

void SaaModbusDevice::OnStarted(const Step& step, MonoNs now) {
  runner_.ExpireIfLate(now);
  if (const auto* set = std::get_if<SetBaudRate>(&step.action)) {
    next_baud_ = set->baud;
    runner_.OnStarted(step.priority == Priority::kCommand);
    return;
  }
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return;
  sent_ = exchange->request;
  const std::optional<Request> asked = ParseRequest(sent_);
  if (asked && asked->writes()) last_write_ = now;
  const bool own = runner_.busy() && step.priority == Priority::kCommand;
  runner_.OnStarted(own);
  if (own) runner_.Report(runner_.procedure().OnStarted(exchange->request, now));
}

void SaaModbusDevice::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      OnExchange(event);
      break;
    case Event::Kind::kUnexpectedBytes:
    case Event::Kind::kUnsolicited:
      OnUnexpectedBytes(event);
      break;
    case Event::Kind::kSilent:
      line_unclear_ = false;
      break;
    case Event::Kind::kBaudRateSet:
      OnBaudRateSet(EndOf(event));
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

void SaaModbusDevice::OnExchange(const Event& event) {
  const MonoNs end = EndOf(event);
  const Answer answer = interpreter_.OnExchange(event);
  sent_.Clear();
  line_unclear_ = answer.unanswered || answer.error == ErrorKind::kChecksum;
  LineFormat present = line_;
  present.baud = connection_.port_baud;
  if (present.baud != line_.baud) not_before_ = end + SilentInterval(present);
  if (runner_.TakeInFlight()) {
    runner_.Report(runner_.procedure().OnAnswer(answer, end));
  } else {
    failures_ = answer.ok() ? 0 : failures_ + 1;
    repeat_ = failures_ == 1;
  }
  CompareWithFile(end);
}

// Every device of the bus receives the event: one of them counts it and keeps the line quiet.
void SaaModbusDevice::OnUnexpectedBytes(const Event& event) {
  if (!keeps_line_) return;
  output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
  line_unclear_ = true;
}

void SaaModbusDevice::OnBaudRateSet(MonoNs now) {
  connection_.port_baud = next_baud_;
  (void)runner_.TakeInFlight();
  if (runner_.busy()) runner_.procedure().OnBaudRateSet(now);
}

void SaaModbusDevice::OnLinkUp(MonoNs now) {
  link_up_ = true;
  line_unclear_ = keeps_line_;
  repeat_ = false;
  failures_ = 0;
  not_before_ = now;
  connection_.port_baud = line_.baud;  // a port is opened at the configured rate
  output_.OnStarting("no answer yet");
}

void SaaModbusDevice::OnLinkDown() {
  link_up_ = false;
  interpreter_.OnLost(sent_);
  sent_.Clear();
  interpreter_.OnLinkDown();
  runner_.OnLinkLost();
}

void SaaModbusDevice::CompareWithFile(MonoNs now) {
  const bool differs = connection_.address != settings_.address || connection_.baud != line_.baud;
  if (differs == differs_) return;
  differs_ = differs;
  output_.OnAlarm(kConfigurationDiffers, differs ? AlarmState::kLive : AlarmState::kAbsent, now);
}

// ---- commands ----

Result<std::unique_ptr<Procedure>> SaaModbusDevice::MakeProcedure(const DriverCommand& command, MonoNs) const {
  return saa_modbus::MakeProcedure(command, context_);
}

Result<> SaaModbusDevice::CheckState(const DriverCommand& command, MonoNs now) const {
  if (!interpreter_.answering() && !LooksElsewhere(command)) {
    return DeviceOffline("the encoder does not answer: check its power, its cable, address and baud");
  }
  const MonoNs wait = last_write_ ? *last_write_ + settings_.write_interval - now : 0;
  if (wait <= 0 || !Writes(command.operation)) return {};
  return Failure(Text("the maker warns of writing regularly: one write in %lld s (write_interval_s); repeat it in "
                      "%.1f s",
                      static_cast<long long>(settings_.write_interval / kSecond),
                      static_cast<double>(wait) / static_cast<double>(kSecond)),
                 Reason::REASON_WEAR);
}

}  // namespace axlecast::saa_modbus
