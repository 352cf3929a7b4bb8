// What one reading of the families that are no streams of bytes costs in CPU time, without any I/O: from the event, as
// the bus hands it over, to the sample. Frames are the makers' own examples (SAA manual 5.4 to 5.6, TWK SSI 5).

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "bench/null_output.h"
#include "core/config/load.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast {
namespace {

constexpr MonoNs kPeriod = kMillisecond;

MachineConfig Machine(const std::string& bus) {
  ConfigErrors errors("bench");
  std::optional<MachineConfig> machine = ParseConfig("machine: bench\nbuses:\n  b: {" + bus + "}\n", errors);
  if (!machine) {
    std::fputs(errors.Text().c_str(), stderr);
    std::exit(1);
  }
  return std::move(*machine);
}

// Hands the same event to a device, again and again.
void Decode(benchmark::State& state, const std::string& bus, Event event) {
  const MachineConfig machine = Machine(bus);
  NullOutput output;
  FixedSecrets secrets;
  const auto device =
      machine.buses[0].family->make_device(machine.buses[0], machine.buses[0].devices[0], output, secrets);
  MonoNs now = kSecond;
  device->On({.kind = Event::Kind::kLinkUp, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}});
  for (auto _ : state) {
    now += kPeriod;
    event.sent = {now, now + 200 * kMicrosecond};
    event.received = {event.sent.last, event.sent.last};
    device->On(event);
  }
  if (output.samples != static_cast<std::int64_t>(state.iterations())) state.SkipWithError("readings were refused");
}

// "101" as bytes, the first bit the most significant; what is missing of the last byte is `fill`.
Frame FromBits(std::string_view bits, std::size_t bytes, bool fill) {
  Frame frame;
  for (std::size_t i = 0; i < bytes; ++i) {
    unsigned byte = 0;
    for (std::size_t j = 8 * i; j < 8 * i + 8; ++j) {
      const bool one = j < bits.size() ? bits[j] == '1' : fill;
      byte = byte << 1U | (one ? 1U : 0U);
    }
    frame.Append(static_cast<std::uint8_t>(byte));
  }
  return frame;
}

void SaaCan(benchmark::State& state) {
  constexpr std::uint8_t kData[] = {0x47, 0x26, 0, 0, 0, 0, 0, 0};
  Decode(state,
         "family: saa_can, simulate: true, devices: {a: {bits: 14, period_ms: 10, limits: {speed_rpm: 100}}}",
         {.kind = Event::Kind::kFrame, .sent = {}, .received = {}, .request = {}, .bytes = kData, .id = 0x120});
}
BENCHMARK(SaaCan);

// The request of a transfer determines the length of its reply.
std::size_t TransferBytes(const std::string& bus) {
  const MachineConfig machine = Machine(bus);
  NullOutput output;
  FixedSecrets secrets;
  const auto device =
      machine.buses[0].family->make_device(machine.buses[0], machine.buses[0].devices[0], output, secrets);
  device->On(
      {.kind = Event::Kind::kLinkUp, .sent = {}, .received = {kSecond, kSecond}, .request = {}, .bytes = {}});
  const Step step = device->Next({.now = kSecond, .poll_due = true});
  const auto* exchange = std::get_if<Exchange>(&step.action);
  return exchange == nullptr ? 0 : exchange->request.size();
}

void Clocked(benchmark::State& state, const std::string& bus, std::string_view bits, bool fill) {
  const Frame reply = FromBits(bits, TransferBytes(bus), fill);
  Decode(state, bus, {.kind = Event::Kind::kReply, .sent = {}, .received = {}, .request = reply, .bytes = reply});
}

// The idle level, then 495 of 4096.
void SsiBinary12(benchmark::State& state) {
  Clocked(state, "family: ssi, simulate: true, devices: {a: {model: saa58p24, bits: 12}}", "1000111101111", false);
}
BENCHMARK(SsiBinary12);

// The tree of 25 bits, Gray.
void SsiGray25(benchmark::State& state) {
  Clocked(state, "family: ssi, simulate: true, devices: {a: {model: twk, bits: 13, turn_bits: 12}}",
          "10000000000111010110100110", false);
}
BENCHMARK(SsiGray25);

// High until the second rising edge, the acknowledgement, start, the fixed 0, 35555 of 65536, no error, a warning, CRC.
void Biss16(benchmark::State& state) {
  Clocked(state, "family: biss, simulate: true, devices: {a: {model: saa58p24, bits: 16}}",
          "110010"
          "1000101011100011"
          "10"
          "001010",
          false);
}
BENCHMARK(Biss16);

}  // namespace
}  // namespace axlecast

BENCHMARK_MAIN();
