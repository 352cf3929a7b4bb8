#include "drivers/ssi/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cmath>
#include <utility>

#include "drivers/runtime/bus/bus.h"
#include "drivers/ssi/simulator.h"
#include "drivers/ssi/test_support.h"
#include "tests/support/recording_output.h"
#include "tests/support/simulator_spi_link.h"

namespace axlecast::ssi {
namespace {

using testing::Contains;
using testing::IsEmpty;
using testing::Pair;

class Indifferent final : public BusObserver {
  void OnLink(bool, std::string_view, MonoNs) override {}
};

// A driver's bus, a device on it and its strict simulator, in virtual time.
class SsiMachine {
 public:
  explicit SsiMachine(const std::string& device, const std::string& simulate = "true", const std::string& keys = "")
      : machine_(LoadMachine("simulate: " + simulate + keys, device)),
        config_(machine_.buses[0]),
        errors_("test"),
        simulator_(MakeSimulator(machine_, config_, errors_)),
        link(clock, *simulator_, config_.devices[0].settings->spi),
        device_(MakeDevice(config_, config_.devices[0], output)),
        bus_(Settings(), link, clock, observer_, nullptr) {
    bus_.Add(*device_);
  }

  void Run(MonoNs time) {
    for (const MonoNs end = clock.Now() + time; clock.Now() < end;) bus_.RunOnce(end);
  }
  void Set(const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set("axis1", key, value, clock.Now())), "");
  }
  [[nodiscard]] const SsiSimulator& simulator() const { return dynamic_cast<const SsiSimulator&>(*simulator_); }
  [[nodiscard]] const SsiSimulator::Counters& counters() const { return simulator().counters(); }
  [[nodiscard]] std::int64_t complaints() const {
    const auto& c = counters();
    return c.wrong_mode + c.slow_clocks + c.fast_clocks + c.late_data + c.short_pauses + c.few_clocks +
           c.monoflop_ends;
  }
  [[nodiscard]] std::string Shows(const std::string& key) const {
    for (const auto& [name, value] : simulator_->State("axis1", clock.Now())) {
      if (name == key) return value;
    }
    return "";
  }
  [[nodiscard]] std::int64_t Errors(ErrorKind kind) const {
    return std::count_if(output.errors.begin(), output.errors.end(),
                         [kind](const auto& error) { return error.first == kind; });
  }

 private:
  [[nodiscard]] BusSettings Settings() const {
    BusSettings settings;
    settings.schedule.ticks.period = kMillisecond;
    settings.schedule.pacing = config_.family_bus->pacing;
    return settings;
  }

  MachineConfig machine_;
  const BusConfig& config_;
  ConfigErrors errors_;
  std::unique_ptr<Simulator> simulator_;
  Indifferent observer_;

 public:
  FakeClock clock;
  RecordingOutput output;
  SimulatorSpiLink link;

 private:
  std::unique_ptr<Device> device_;
  Bus bus_;
};

struct Kind {
  const char* name;
  const char* device;
  const char* keys;
};

// Whatever the encoder: each reading is what it stored, at that instant, and nothing is done that its maker forbids.
TEST(SsiDevice, ReadsWhatTheEncoderStored) {
  const Kind kinds[] = {
      {"saa 12", "model: saa, bits: 12", ""},
      {"saa 26 repeated", "model: saa, bits: 26, repeat: no_gap", ", link: {clock_hz: 240000}"},
      {"twk tree", "model: twk, bits: 13, turn_bits: 12", ", cable_m: 200"},
      {"twk 18", "model: twk, bits: 10, turn_bits: 8, repeat: one_zero", ""},
      {"twk halves", "model: twk, bits: 13, turn_bits: 12, halves: separate, trailing: repeat", ""},
      {"twk binary plain", "model: twk, bits: 20, turn_bits: 12, format: plain, code: binary",
       ", link: {clock_hz: 900000}"},
      {"32 bits", "model: custom, code: gray, bits: 32", ", monoflop_us: {min: 12, max: 40}, cable_m: 100"},
      {"status",
       "model: custom, code: gray, bits: 13, turn_bits: 9, first_bit: 2, status_bits: {a: {bit: 1}, b: {bit: 25, "
       "active: low}}, parity: {bit: 26, sense: odd}",
       ", monoflop_us: {min: 12, max: 400}"},
  };
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.name);
    SsiMachine machine(kind.device, "{axis1: {start_deg: 33}}", kind.keys);
    machine.Set("speed_rpm", "3000");
    machine.Run(kSecond);
    const double per_turn = std::ldexp(1.0, machine.simulator().encoder().properties.word.bits);
    std::size_t seen = 0;
    for (int i = 0; i < 300; ++i) {
      machine.Run(kMillisecond);
      if (machine.output.samples.size() == std::exchange(seen, machine.output.samples.size())) continue;
      const Sample& sample = machine.output.samples.back();
      EXPECT_EQ(sample.at.first, sample.at.last);
      // What the simulator shows is as of now.
      const double turned = 3000.0 / 60 * static_cast<double>(machine.clock.Now() - sample.at.first) * 1e-9;
      const double shown = std::stod(machine.Shows("angle_deg")) / 360 - turned;
      const double read = static_cast<double>(sample.counts) / per_turn;
      EXPECT_NEAR(std::remainder(shown - read, 1.0), 0, 1.5 / per_turn + 1e-6);
    }
    EXPECT_GT(seen, 100U) << kind.name;
    EXPECT_THAT(machine.output.errors, IsEmpty()) << kind.name;
    EXPECT_EQ(machine.complaints(), 0) << kind.name;
  }
}

TEST(SsiDevice, TurnsAreTold) {
  SsiMachine machine("model: twk, bits: 10, turn_bits: 8", "{axis1: {start_turns: 200, start_deg: 90}}");
  machine.Run(10 * kMillisecond);
  ASSERT_FALSE(machine.output.samples.empty());
  const Sample& sample = machine.output.samples.back();
  EXPECT_TRUE(sample.has_turns);
  EXPECT_EQ(sample.turns, 200);
  EXPECT_EQ(sample.counts, 256);
}

// No encoder: errors of kind timeout, an alarm after three, and no flood of transfers; and it comes back.
TEST(SsiDevice, NoEncoder) {
  SsiMachine machine("model: saa, bits: 12");
  machine.Set("power", "off");
  machine.Run(kSecond);
  EXPECT_THAT(machine.output.samples, IsEmpty());
  EXPECT_EQ(machine.Errors(ErrorKind::kTimeout), std::ssize(machine.output.errors));
  EXPECT_LT(machine.counters().transfers, 40);
  EXPECT_THAT(machine.output.alarms, Contains(Pair(LineAlarm(WordError::kNoZero)->code, AlarmState::kLive)));
  machine.Set("power", "on");
  machine.Run(200 * kMillisecond);
  EXPECT_GT(machine.output.samples.size(), 100U);
  EXPECT_EQ(machine.output.alarms.back(), std::pair(LineAlarm(WordError::kNoZero)->code, AlarmState::kAbsent));
}

struct LineFault {
  const char* key;
  const char* value;
  ErrorKind kind;
  WordError error;
};

TEST(SsiDevice, FaultsOfTheLineHaveTheirNames) {
  const LineFault faults[] = {{"data_line", "low", ErrorKind::kFraming, WordError::kIdleLow},
                              {"data_line", "swapped", ErrorKind::kFraming, WordError::kIdleLow},
                              {"fault", "echo", ErrorKind::kFraming, WordError::kIdleLow},
                              {"data_line", "high", ErrorKind::kTimeout, WordError::kNoZero},
                              {"after_word", "one_zero", ErrorKind::kRange, WordError::kTrailing}};
  for (const LineFault& fault : faults) {
    SsiMachine machine("model: twk, bits: 13, turn_bits: 12", "{axis1: {start_turns: 4095, start_deg: 350}}");
    machine.Set(fault.key, fault.value);
    machine.Run(100 * kMillisecond);
    EXPECT_THAT(machine.output.samples, IsEmpty()) << fault.value;
    EXPECT_EQ(machine.Errors(fault.kind), std::ssize(machine.output.errors)) << fault.value;
    EXPECT_THAT(machine.output.alarms, Contains(Pair(LineAlarm(fault.error)->code, AlarmState::kLive)))
        << fault.value;
  }
}

// A controller that rests between bytes for longer than the monoflop: the encoder latches again in the middle. What is
// read twice, and what must be 0, shows it; nothing of it is published.
TEST(SsiDevice, AMonoflopThatRunsDownInTheWordIsSeen) {
  for (const char* device : {"model: twk, bits: 13, turn_bits: 12, repeat: one_zero",
                             "model: twk, bits: 13, turn_bits: 12", "model: twk, bits: 10, turn_bits: 8"}) {
    SsiMachine machine(device, "{axis1: {start_turns: 85, start_deg: 200, byte_gap_us: 30}}");
    machine.Run(100 * kMillisecond);
    EXPECT_THAT(machine.output.samples, IsEmpty()) << device;
    EXPECT_GT(machine.counters().monoflop_ends, 50);
  }
}

// TWK SSI 1: "multiple transmission of each data word provides an automatic plausibility check".
TEST(SsiDevice, ARepeatThatDiffersIsCountedAndNotPublished) {
  SsiMachine machine("model: twk, bits: 13, turn_bits: 12, repeat: one_zero",
                     "{axis1: {start_turns: 7, start_deg: 123}}");
  machine.Set("fault", "bit_flip:0.02");
  machine.Run(4 * kSecond);
  EXPECT_GT(machine.Errors(ErrorKind::kChecksum), 100);
  EXPECT_GT(machine.output.samples.size(), 100U);
  const auto wrong = std::count_if(machine.output.samples.begin(), machine.output.samples.end(),
                                   [](const Sample& sample) { return sample.turns != 7 || sample.counts != 2798; });
  // 25 places, each inverted in both words with 0.02 squared; of what passes about one in a hundred.
  EXPECT_LT(wrong, std::ssize(machine.output.samples) / 20);
}

TEST(SsiDevice, BitsThatDoNotFitAreSeen) {
  // A word of the whole tree for an encoder that is configured as the 18-bit one.
  const MachineConfig wrong = LoadMachine("simulate: true", "model: twk, bits: 10, turn_bits: 8");
  RecordingOutput output;
  const std::unique_ptr<Device> device = MakeDevice(wrong.buses[0], wrong.buses[0].devices[0], output);
  const ClockedBits word("1 1000011100101110111111110 000000");
  device->On({.kind = Event::Kind::kReply,
              .sent = {1'000, 2'000},
              .received = {2'000, 2'000},
              .request = {},
              .bytes = word.bytes});
  ASSERT_EQ(output.errors.size(), 1U);
  EXPECT_EQ(output.errors[0].first, ErrorKind::kRange);
}

TEST(SsiDevice, StatusBits) {
  SsiMachine machine(
      "model: custom, code: binary, bits: 12, status_bits: {alarm: {bit: 13}, power_fail: {bit: 14, active: low, "
      "severity: "
      "warning}}, parity: {bit: 15, sense: even}",
      "true", ", monoflop_us: {min: 15, max: 25}");
  machine.Run(10 * kMillisecond);
  ASSERT_FALSE(machine.output.samples.empty());
  EXPECT_FALSE(machine.output.samples.back().error || machine.output.samples.back().warning);
  EXPECT_EQ(machine.output.samples.back().device_status, 0);
  machine.Set("status", "power_fail");
  machine.Run(10 * kMillisecond);
  EXPECT_TRUE(machine.output.samples.back().warning);
  EXPECT_FALSE(machine.output.samples.back().error);
  EXPECT_EQ(machine.output.samples.back().device_status, 2);
  EXPECT_THAT(machine.output.alarms, Contains(Pair(0x121, AlarmState::kLive)));
  machine.Set("status", "alarm");
  machine.Run(10 * kMillisecond);
  EXPECT_TRUE(machine.output.samples.back().error);
  EXPECT_EQ(machine.output.samples.back().device_status, 1);
  EXPECT_EQ(machine.output.alarms.back(), std::pair(std::int32_t{0x121}, AlarmState::kAbsent));
  EXPECT_THAT(machine.output.errors, IsEmpty());
}

// The first falling edge comes after the transfer was asked for, and all of its clocks come after the edge.
TEST(SsiDevice, TheInstantIsThatOfTheFirstFallingEdge) {
  const MachineConfig machine =
      LoadMachine("link: {spidev: /dev/spidev0.0, clock_hz: 160000}", "model: saa, bits: 12");
  RecordingOutput output;
  const std::unique_ptr<Device> device = MakeDevice(machine.buses[0], machine.buses[0].devices[0], output);
  const ClockedBits word("1 000111101111 000");
  Event event{.kind = Event::Kind::kReply,
              .sent = {kSecond, kSecond + 400 * kMicrosecond},
              .received = {},
              .request = {},
              .bytes = word.bytes};
  event.received = {event.sent.last, event.sent.last + 1'000};
  device->On(event);
  ASSERT_EQ(output.samples.size(), 1U);
  // 16 clocks of 6.25 us.
  EXPECT_EQ(output.samples[0].at, (Interval{kSecond, kSecond + 300 * kMicrosecond}));
  EXPECT_EQ(output.samples[0].counts, 495);
  // A controller that is faster than it was asked to be leaves no time before the request.
  event.sent = {kSecond, kSecond + 50 * kMicrosecond};
  device->On(event);
  EXPECT_EQ(output.samples[1].at, (Interval{kSecond, kSecond}));
}

TEST(SsiDevice, ThereIsNothingToOrder) {
  const MachineConfig config = LoadMachine("simulate: true", "model: saa, bits: 12");
  RecordingOutput output;
  const std::unique_ptr<Device> device = MakeDevice(config.buses[0], config.buses[0].devices[0], output);
  device->Begin({.id = {7}, .operation = "zero", .arguments = {}}, kSecond);
  ASSERT_EQ(output.outcomes.size(), 1U);
  EXPECT_EQ(output.outcomes[0].second.state, CommandState::kRejected);
  EXPECT_EQ(output.outcomes[0].second.reason, command_status_t::REASON_UNKNOWN_OPERATION);
  EXPECT_FALSE(device->Cancel({7}, kSecond));
}

}  // namespace
}  // namespace axlecast::ssi
