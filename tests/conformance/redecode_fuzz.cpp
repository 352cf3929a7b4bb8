// Any log: what is decoded again of hostile WIRE messages never crashes, hangs or becomes a report that cannot be read.
// Inputs change what the drivers of every example recorded in virtual time, so that each family's code is reached.
#include <fuzzer/FuzzedDataProvider.h>

#include <axlecast/device_info_t.hpp>
#include <axlecast/wire_t.hpp>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "core/config/load.h"
#include "core/messages/message.h"
#include "tests/conformance/example_link.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/memory_sink.h"
#include "tools/redecode/log_redecoder.h"

namespace axlecast {
namespace {

constexpr MonoNs kRecorded = 3 * kSecond;
constexpr std::size_t kMaxMessages = 60;  // of a recording
constexpr int kMaxSteps = 100;            // of an input

void Require(bool holds) {
  if (!holds) std::abort();
}

// What the driver of an example's bus recorded.
struct Capture {
  MachineConfig machine;
  std::string bus;
  std::vector<wire_t> messages;
};

std::vector<wire_t> Record(const MachineConfig& machine, const BusConfig& bus) {
  ConfigErrors errors("");
  const auto simulator = MakeSimulator(machine, bus, errors);
  Require(simulator != nullptr);
  FakeClock clock;
  ExampleLink link(bus, clock, *simulator);
  MemorySink data;
  MemorySink commands;
  FixedSecrets secrets;
  secrets.any = "password";
  DriverPorts ports{.secrets = &secrets,
                    .clock = &clock,
                    .data = &data,
                    .commands = &commands,
                    .log = [](LogLevel, std::string_view) {},
                    .link_warnings = {}};
  link.PlugInto(ports);
  BridgeConfig bridge;
  bridge.allow_unsigned = true;
  Driver driver(bus, bridge, Origin{.boot_id = 42}, std::move(ports));
  const auto recorded = [&] { return data.Messages("WIRE/" + bus.name).size(); };
  for (const MonoNs end = clock.Now() + kRecorded; clock.Now() < end && recorded() < kMaxMessages;)
    driver.RunOnce();
  driver.Stop();
  return data.All<wire_t>("WIRE/" + bus.name);
}

std::vector<Capture> RecordAll() {
  std::vector<Capture> captures;
  for (const Family* family : Families()) {
    const std::string file = std::string(AXLECAST_SOURCE "/drivers/") + std::string(family->name) + "/example.yaml";
    ConfigErrors errors(file);
    auto machine = LoadConfig(file, errors);
    Require(machine.has_value());
    for (BusConfig& bus : machine->buses) bus.capture = true;
    for (const BusConfig& bus : machine->buses) {
      captures.push_back({*machine, bus.name, Record(*machine, bus)});
      Require(!captures.back().messages.empty());
    }
  }
  return captures;
}

// A number near an end of its range, or any.
std::int64_t DrawNumber(FuzzedDataProvider& input) {
  constexpr std::int64_t kEnds[] = {0, 1, -1, std::numeric_limits<std::int64_t>::max(),
                                    std::numeric_limits<std::int64_t>::min()};
  return input.ConsumeBool() ? input.PickValueInArray(kEnds) : input.ConsumeIntegral<std::int64_t>();
}

void ChangeHead(FuzzedDataProvider& input, wire_t& message) {
  switch (input.ConsumeIntegralInRange(0, 5)) {
    case 0:
      message.utime = DrawNumber(input);
      break;
    case 1:
      message.mono_ns = input.ConsumeBool() ? DrawNumber(input) : message.mono_ns + input.ConsumeIntegral<int>();
      break;
    case 2:
      message.boot_id = DrawNumber(input);
      break;
    case 3:
      message.seq = DrawNumber(input);
      break;
    case 4:
      message.dropped = DrawNumber(input);
      break;
    default:
      message.kind = input.ConsumeIntegral<std::int8_t>();
  }
}

void ChangeRecord(FuzzedDataProvider& input, wire_record_t& record) {
  switch (input.ConsumeIntegralInRange(0, 7)) {
    case 0:
      record.dt_ns = input.ConsumeIntegral<std::int32_t>();
      break;
    case 1:
      record.duration_ns = input.ConsumeIntegral<std::int32_t>();
      break;
    case 2:
      record.direction = input.ConsumeIntegralInRange<std::int8_t>(-1, 10);
      break;
    case 3:
      record.flags = input.ConsumeIntegral<std::int8_t>();
      break;
    case 4:
      record.id = input.ConsumeBool() ? input.ConsumeIntegralInRange(-1, 20) : input.ConsumeIntegral<int>();
      break;
    case 5:
      record.data = input.ConsumeBytes<std::uint8_t>(input.ConsumeIntegralInRange<std::size_t>(0, 264));
      break;
    case 6:
      record.data.resize(input.ConsumeIntegralInRange<std::size_t>(0, 264));
      break;
    default:
      if (!record.data.empty()) {
        record.data[input.ConsumeIntegralInRange<std::size_t>(0, record.data.size() - 1)] =
            input.ConsumeIntegral<std::uint8_t>();
      }
  }
  record.len = static_cast<std::int16_t>(record.data.size());
}

// The log of one input, decoded again.
class HostileLog {
 public:
  explicit HostileLog(const Capture& capture)
      : capture_(capture), redecoder_(capture.machine, "", [](const LogEvent& event) {
          Require(!event.channel.empty() && !event.data.empty());
        }) {}

  void Step(FuzzedDataProvider& input) {
    switch (input.ConsumeIntegralInRange(0, 6)) {
      case 0:
        for (int i = input.ConsumeIntegralInRange(1, 4); i > 0; --i) OnWire(Next());
        break;
      case 1: {
        wire_t message = Next();
        ChangeHead(input, message);
        OnWire(message);
        break;
      }
      case 2: {
        wire_t message = Next();
        if (message.n == 0) break;
        const auto last = static_cast<std::size_t>(message.n - 1);
        ChangeRecord(input, message.records[input.ConsumeIntegralInRange<std::size_t>(0, last)]);
        OnWire(message);
        break;
      }
      case 3:
        at_ += input.ConsumeIntegralInRange<std::size_t>(0, kMaxMessages);
        break;
      case 4:
        OnDevice(input);
        break;
      case 5:
        On("POSITION/" + Device(input).name, input.ConsumeBytes<std::uint8_t>(100));
        break;
      default:
        On("WIRE/" + capture_.bus, input.ConsumeBytes<std::uint8_t>(100));
    }
  }
  void End() {
    redecoder_.Finish();
    static_cast<void>(ToText(redecoder_, true));
    static_cast<void>(ToJson(redecoder_, true).dump());
  }

 private:
  const wire_t& Next() { return capture_.messages[at_++ % capture_.messages.size()]; }

  [[nodiscard]] const DeviceConfig& Device(FuzzedDataProvider& input) const {
    const auto& devices = capture_.machine.FindBus(capture_.bus)->devices;
    return devices[input.ConsumeIntegralInRange<std::size_t>(0, devices.size() - 1)];
  }
  void OnDevice(FuzzedDataProvider& input) {
    device_info_t info{};
    info.boot_id = 42;
    info.device = Device(input).name;
    info.datum_counts = DrawNumber(input);
    info.datum_utime = DrawNumber(input);
    On("DEVICE/" + info.device, Encoded(info));
  }
  void OnWire(const wire_t& message) { On("WIRE/" + capture_.bus, Encoded(message)); }
  void On(const std::string& channel, const std::vector<std::uint8_t>& data) {
    const std::string whole = capture_.machine.lcm.prefix + channel;
    redecoder_.On({.number = number_++, .utime = 0, .channel = whole, .data = data});
  }

  const Capture& capture_;
  LogRedecoder redecoder_;
  std::size_t at_ = 0;
  std::int64_t number_ = 0;
};

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  static const std::vector<Capture> kCaptures = RecordAll();
  if (size == 0) return 0;
  FuzzedDataProvider input(data + 1, size - 1);
  HostileLog log(kCaptures[data[0] % kCaptures.size()]);
  for (int i = 0; i < kMaxSteps && input.remaining_bytes() > 0; ++i) log.Step(input);
  log.End();
  return 0;
}
