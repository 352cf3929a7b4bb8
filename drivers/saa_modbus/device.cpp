#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "core/config/machine_config.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/family.h"
#include "drivers/saa_modbus/operations.h"

namespace axlecast::saa_modbus {
namespace {

const SaaModbusSettings& Own(const DeviceConfig& device) {
  return static_cast<const SaaModbusSettings&>(*device.settings);
}

std::vector<std::uint8_t> OtherAddresses(const BusConfig& bus, const DeviceConfig& own) {
  std::vector<std::uint8_t> addresses;
  for (const DeviceConfig& device : bus.devices) {
    if (device.name != own.name) addresses.push_back(Own(device).address);
  }
  return addresses;
}

// One encoder on a Modbus bus. Selects the next request; the Interpreter evaluates the replies.
//
// - After an unclear exchange, the line must be idle for `timeout_us` first.
// - While a late reply could be taken for the one to a request (StaleReplyGuard), an encoder up to 16 bits is asked for
//   the other number of registers (SAA manual 5.1.7: "the reading points could be 01 or 02").
// - A reading that failed is repeated once at once; then in the next slot.
// - The exchanges of a command come before live readings: they are few, and their readings are published as well.
// - It follows a change of the encoder's address or baud rate until the driver is restarted.
class SaaModbusDevice final : public CommandDevice<Procedure> {
 public:
  SaaModbusDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        settings_(Own(device)),
        line_(bus.link.line),
        keeps_line_(bus.devices.empty() || bus.devices.front().name == device.name),
        other_addresses_(OtherAddresses(bus, device)),
        connection_{.address = settings_.address, .baud = line_.baud, .port_baud = line_.baud},
        context_{settings_, output_, connection_, other_addresses_},
        // A simulated wire may be faster than a real one.
        interpreter_(settings_, bus.simulate ? LineFormat{} : line_, connection_, output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    const auto idle = [](MonoNs until) { return Step{.action = Idle{until}, .priority = Priority::kLive}; };
    if (!link_up_) return idle(kNever);
    if (line_unclear_) return {.action = WaitForIdleLine{Timeout()}, .priority = Priority::kLive};
    if (slot.now < not_before_) return idle(not_before_);
    // A command that has begun is not interrupted: it may change the address or the rate, and it takes readings itself.
    const Procedure* procedure = runner_.Runnable(slot.now);
    if (procedure == nullptr || (slot.reserved && !runner_.HasBegun())) return LiveStep(slot);
    return CommandStep(procedure->Next(slot.now), slot);
  }

  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    if (const auto* rate = std::get_if<SetBaudRate>(&step.action)) {
      next_baud_ = rate->baud;
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

  void On(const Event& event) override {
    const MonoNs end = event.End();
    switch (event.kind) {
      case Event::Kind::kReply:
      case Event::Kind::kTimeout:
        OnExchange(event);
        break;
      case Event::Kind::kUnexpectedBytes:
      case Event::Kind::kUnsolicited:
        // Every device of the bus receives the event: one of them counts it and keeps the line idle.
        if (!keeps_line_) break;
        output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
        line_unclear_ = true;
        break;
      case Event::Kind::kSilent:
        line_unclear_ = false;
        break;
      case Event::Kind::kBaudRateSet:
        connection_.port_baud = next_baud_;
        (void)runner_.TakeInFlight();
        if (runner_.busy()) runner_.procedure().OnBaudRateSet(end);
        break;
      case Event::Kind::kLinkUp:
        OnLinkUp(end);
        break;
      case Event::Kind::kLinkDown:
        link_up_ = false;
        interpreter_.OnLinkLost(sent_);
        sent_.Clear();
        runner_.OnLinkLost();
        break;
      default:  // of other kinds of line
        break;
    }
    runner_.ExpireIfLate(end);
  }

 private:
  // ---- steps ----

  [[nodiscard]] Step LiveStep(const BusSlot& slot) const {
    if (connection_.port_baud != connection_.baud) {
      return {.action = SetBaudRate{connection_.baud}, .priority = Priority::kLive};
    }
    if (!slot.poll_due && !repeat_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    return Read(connection_.address, slot, Priority::kLive);
  }

  [[nodiscard]] Step CommandStep(const ProcedureStep& step, const BusSlot& slot) const {
    const auto command = [](auto action) { return Step{.action = action, .priority = Priority::kCommand}; };
    if (const auto* read = std::get_if<ReadAt>(&step)) return Read(read->address, slot, Priority::kCommand);
    if (const auto* request = std::get_if<Frame>(&step)) return command(ExchangeOf(*request));
    if (const auto* rate = std::get_if<SetBaudRate>(&step)) return command(*rate);
    return command(std::get<Idle>(step));
  }

  [[nodiscard]] Step Read(std::uint8_t address, const BusSlot& slot, Priority priority) const {
    const Exchange usual = ExchangeOf(ReadRequest(address, settings_.registers));
    if (slot.MaySend(usual) || settings_.bits > kOneRegisterBits) return {.action = usual, .priority = priority};
    const Exchange other = ExchangeOf(ReadRequest(address, 3 - settings_.registers));
    return {.action = slot.MaySend(other) ? other : usual, .priority = priority};
  }

  [[nodiscard]] Exchange ExchangeOf(const Frame& request) const {
    Exchange exchange{.request = request, .reply_length = &ReplyLength, .timeout = Timeout()};
    exchange.shape = ReplyShapeOf(request);
    return exchange;
  }

  // The configured line at the present rate of the port.
  [[nodiscard]] LineFormat PresentLine() const {
    LineFormat present = line_;
    present.baud = connection_.port_baud;
    return present;
  }
  // At a slower rate than the configured one, an exchange takes longer.
  [[nodiscard]] MonoNs Timeout() const {
    return settings_.timeout + std::max<MonoNs>(0, LongestExchange(PresentLine()) - LongestExchange(line_));
  }

  // ---- events ----

  void OnExchange(const Event& event) {
    const MonoNs end = event.End();
    const Answer answer = interpreter_.OnExchange(event);
    sent_.Clear();
    line_unclear_ = answer.unanswered || answer.error == ErrorKind::kChecksum;
    if (connection_.port_baud != line_.baud) not_before_ = end + SilentInterval(PresentLine());
    if (runner_.TakeInFlight()) {
      runner_.Report(runner_.procedure().OnAnswer(answer, end));
    } else {
      failures_ = answer.ok() ? 0 : failures_ + 1;
      repeat_ = failures_ == 1;
    }
    const bool differs = connection_.address != settings_.address || connection_.baud != line_.baud;
    if (differs == differs_) return;
    differs_ = differs;
    output_.OnAlarm(kConfigurationDiffers, differs ? AlarmState::kLive : AlarmState::kAbsent, end);
  }

  void OnLinkUp(MonoNs now) {
    link_up_ = true;
    line_unclear_ = keeps_line_;
    repeat_ = false;
    failures_ = 0;
    not_before_ = now;
    connection_.port_baud = line_.baud;  // a port is opened at the configured rate
    output_.OnStarting("no answer yet");
  }

  // ---- commands ----

  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs) const override {
    return saa_modbus::MakeProcedure(command, context_);
  }

  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override {
    if (!interpreter_.answering() && !LooksElsewhere(command)) {
      return DeviceOffline("the encoder does not answer: check its power, its cable, address and baud");
    }
    const MonoNs wait = last_write_ ? *last_write_ + settings_.write_interval - now : 0;
    if (wait <= 0 || !Writes(command.operation)) return {};
    return Failure(
        Text("the maker warns of writing regularly: one write in %lld s (write_interval_s); repeat it in "
             "%.1f s",
             static_cast<long long>(settings_.write_interval / kSecond),
             static_cast<double>(wait) / static_cast<double>(kSecond)),
        command_status_t::REASON_WEAR);
  }

  const SaaModbusSettings& settings_;
  const LineFormat line_;  // as configured
  const bool keeps_line_;  // it waits for an idle line after unexpected bytes: one device of a bus does
  const std::vector<std::uint8_t> other_addresses_;
  Connection connection_;
  const OperationContext context_;
  Interpreter interpreter_;

  bool line_unclear_ = false;   // an idle line is required before the next request
  bool repeat_ = false;         // the live exchange that failed
  int failures_ = 0;            // live exchanges in a row
  MonoNs not_before_ = 0;       // the silent interval at another rate than the configured one
  bool differs_ = false;        // the alarm is raised
  Frame sent_;                  // under way
  std::int64_t next_baud_ = 0;  // of the SetBaudRate under way

  std::optional<MonoNs> last_write_;  // of the encoder's memory
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource&) {
  return std::make_unique<SaaModbusDevice>(bus, device, output);
}

}  // namespace axlecast::saa_modbus
