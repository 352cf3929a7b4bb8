// What one T-format reading costs in CPU time, without any I/O: the codec, the device, and the whole way to an
// encoded message.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "bench/null_output.h"
#include "core/config/load.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/tformat/codec.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {
namespace {

constexpr MonoNs kExchangeTime = 51 * kMicrosecond;

// A shaft at rest; each reading of it becomes a POSITION message (51 us apart, at most every 50 us).
constexpr const char* kMachine = R"(
machine: bench
buses:
  b: {family: tformat, poll_hz: 0, simulate: true,
      devices: {axis1: {model: ts5669n127, unit: deg, publish_hz: 20000}}}
)";

Frame ReplyTo(tformat::DataId id) {
  tformat::Reply reply;
  reply.id = id;
  reply.status = 0;
  reply.single_turn = 0x12345;
  reply.multi_turn = 0x1234;
  reply.encoder_id = 0x11;
  reply.alarms = 0;
  return tformat::MakeReply(reply);
}

void ParseReply(benchmark::State& state, tformat::DataId id) {
  const Frame request = tformat::Request(id);
  Frame reply = ReplyTo(id);
  const tformat::Format format;
  for (auto _ : state) {
    benchmark::DoNotOptimize(reply);
    benchmark::DoNotOptimize(tformat::ParseReply(request, reply, format));
  }
}
BENCHMARK_CAPTURE(ParseReply, id3, tformat::DataId::kAll);
BENCHMARK_CAPTURE(ParseReply, id0, tformat::DataId::kSingleTurn);

class NullSink final : public MessageSink {
 public:
  void Publish(const std::string&, Bytes message) override {
    benchmark::DoNotOptimize(message.data());
    ++messages;
  }
  std::int64_t messages = 0;
};

MachineConfig Machine() {
  ConfigErrors errors("bench");
  std::optional<MachineConfig> machine = ParseConfig(kMachine, errors);
  if (!machine) {
    std::fputs(errors.Text().c_str(), stderr);
    std::exit(1);
  }
  return std::move(*machine);
}

// One encoder whose ID 3 replies come one after the other.
class Readings {
 public:
  Readings(const BusConfig& bus, DeviceOutput& output)
      : device_(bus.family->make_device(bus, bus.devices[0], output, secrets_)) {
    device_->On(
        {.kind = Event::Kind::kLinkUp, .sent = {now_, now_}, .received = {now_, now_}, .request = {}, .bytes = {}});
  }

  // The bus's part of a slot: the next step of the device.
  void Ask() {
    const Step step = device_->Next({.now = now_, .poll_due = true});
    device_->OnStarted(step, now_);
  }

  void Answer() {
    const Interval sent{now_, now_ + kMicrosecond};
    now_ += kExchangeTime;
    const Interval received{now_ - kMicrosecond, now_ - kMicrosecond};
    device_->On(
        {.kind = Event::Kind::kReply, .sent = sent, .received = received, .request = request_, .bytes = reply_});
  }

  [[nodiscard]] MonoNs now() const { return now_; }

 private:
  const Frame request_ = tformat::Request(tformat::DataId::kAll);
  const Frame reply_ = ReplyTo(tformat::DataId::kAll);
  FixedSecrets secrets_;
  std::unique_ptr<Device> device_;
  MonoNs now_ = kSecond;
};

void DeviceOnReply(benchmark::State& state) {
  const MachineConfig machine = Machine();
  NullOutput output;
  Readings readings(machine.buses[0], output);
  readings.Ask();
  for (auto _ : state) readings.Answer();
  if (output.samples != static_cast<std::int64_t>(state.iterations())) state.SkipWithError("readings were refused");
}
BENCHMARK(DeviceOnReply);

void DeviceNextAndReply(benchmark::State& state) {
  const MachineConfig machine = Machine();
  NullOutput output;
  Readings readings(machine.buses[0], output);
  for (auto _ : state) {
    readings.Ask();
    readings.Answer();
  }
  if (output.samples != static_cast<std::int64_t>(state.iterations())) state.SkipWithError("readings were refused");
}
BENCHMARK(DeviceNextAndReply);

// Device and channel: plausibility, scaling, and a POSITION message for each reading.
void ReplyToMessage(benchmark::State& state) {
  const MachineConfig machine = Machine();
  const BusConfig& bus = machine.buses[0];
  NullSink sink;
  Timebase time;
  time.Update(kSecond, 1'700'000'000'000'000);
  DevicePublisher channel(bus, bus.devices[0],
                          {.origin = {.boot_id = 1}, .time = &time, .sink = &sink, .on_outcome = {}});
  channel.OnLink(true, "", kSecond);
  Readings readings(bus, channel);
  readings.Ask();
  for (auto _ : state) readings.Answer();
  if (sink.messages < static_cast<std::int64_t>(state.iterations())) state.SkipWithError("readings were withheld");
}
BENCHMARK(ReplyToMessage);

}  // namespace
}  // namespace axlecast

BENCHMARK_MAIN();
