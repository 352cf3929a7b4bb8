// Any host: whatever its modes, clocks, lengths and pauses, the simulated encoder answers every bit and continues.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "drivers/ssi/simulator.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  FuzzedDataProvider input(data, size);
  ssi::SimulatedEncoder::Properties properties;
  properties.monoflop_us = input.ConsumeFloatingPointInRange(0.1, 500.0);
  properties.after_word =
      input.PickValueInArray({ssi::SimulatedOutput::AfterWord::kZeros, ssi::SimulatedOutput::AfterWord::kOneZero,
                              ssi::SimulatedOutput::AfterWord::kNoGap});
  ssi::SsiSimulator simulator("a", ssi::SimulatedEncoder(properties, {123'456'789, 1}), Script(), {0, 0});
  MonoNs now = kSecond;
  for (int i = 0; i < 8 && input.remaining_bytes() > 0; ++i) {
    if (input.ConsumeBool()) {
      const std::string key = input.PickValueInArray({"fault", "cable_m", "monoflop_us", "byte_gap_us", "data_line",
                                                      "status", "motion", "power", "after_word"});
      static_cast<void>(simulator.Set("a", key, input.ConsumeRandomLengthString(12), now));
    }
    const std::vector<std::uint8_t> tx(input.ConsumeIntegralInRange<std::size_t>(1, 10));
    std::vector<std::uint8_t> rx(tx.size());
    const SpiSettings settings{.mode = input.ConsumeIntegralInRange(0, 3),
                               .clock_hz = input.ConsumeIntegralInRange<std::int64_t>(0, 50'000'000)};
    simulator.OnTransfer({.settings = settings, .bits_per_word = 8, .tx = tx}, now, rx);
    now += settings.ClockTime(static_cast<std::int64_t>(tx.size()) * 8) +
           input.ConsumeIntegralInRange<MonoNs>(0, kMillisecond);
  }
  const auto& counters = simulator.counters();
  if (counters.latches < 0 || counters.unanswered > counters.transfers) std::abort();
  return 0;
}
