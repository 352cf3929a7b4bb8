#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "drivers/tformat/device_test_support.h"
#include "drivers/tformat/family.h"
#include "drivers/tformat/operations.h"

// The device against the simulated encoder in virtual time: what it reports must be what was really done.
namespace axlecast::tformat {
namespace {

class Machine {
 public:
  explicit Machine(const std::string& keys = "{model: ts5669n127, eeprom_writable: [10, 11]}",
                   const std::string& simulate = "{}")
      : bench(keys, false, true), errors_("simulate.yaml") {
    bus_ = bench.bus();
    bus_.devices = {bench.config()};
    bus_.devices[0].name = "axis1";
    ConfigMap map(YAML::Load("{axis1: " + simulate + "}"), "simulate", errors_);
    simulator_ = MakeTFormatSimulator(bus_, map);
    EXPECT_TRUE(errors_.empty()) << errors_.Text();
    bench.output.motion = [this](MonoNs at) { return MotionAt(at); };
    bench.LinkUp();
  }

  [[nodiscard]] std::string Shown(const std::string& key) const {
    for (const auto& [name, value] : simulator_->State("axis1", bench.now)) {
      if (name == key) return value;
    }
    ADD_FAILURE() << "no quantity " << key;
    return "0";
  }
  [[nodiscard]] int Count(const std::string& key) const { return std::stoi(Shown(key)); }
  void Set(const char* key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set("axis1", key, value, bench.now)), "");
  }

  void Run(MonoNs duration) {
    const MonoNs end = bench.now + duration;
    while (bench.now < end) RunStep(end);
  }
  // Until the order has its one outcome.
  const Outcome& Finish(MonoNs maximum = 10 * kSecond) {
    const int before = bench.FinalOutcomes();
    const MonoNs end = bench.now + maximum;
    while (bench.now < end && bench.FinalOutcomes() == before) RunStep(end);
    EXPECT_EQ(bench.FinalOutcomes(), before + 1);
    Run(100 * kMillisecond);
    EXPECT_EQ(bench.FinalOutcomes(), before + 1);
    return bench.Last();
  }
  const Outcome& Do(const std::string& operation, std::vector<std::pair<std::string, std::string>> arguments = {}) {
    const int before = bench.FinalOutcomes();
    bench.Begin(operation, std::move(arguments));
    return bench.FinalOutcomes() > before ? bench.Last() : Finish();
  }

  DeviceFixture bench;

 private:
  void RunStep(MonoNs end) {
    const Step step = bench.device->Next({.now = bench.now, .poll_due = bench.now >= slot_});
    if (const auto* exchange = std::get_if<Exchange>(&step.action)) return Transmit(step, *exchange);
    if (const auto* silence = std::get_if<WaitForIdleLine>(&step.action)) {
      bench.device->OnStarted(step, bench.now);
      return KeepSilence(bench.now + silence->quiet);
    }
    if (bench.now >= slot_) slot_ = bench.now + 1 * kMillisecond;  // not requested
    MoveTo(std::min({std::get<Idle>(step.action).until, std::max(slot_, bench.now + 1), end}));
    if (!line_.empty()) Stray();
  }

  void Transmit(const Step& step, const Exchange& exchange) {
    if (bench.now >= slot_ && step.priority == Priority::kLive) slot_ = bench.now + 1 * kMillisecond;
    const Exchange copy = exchange;
    bench.device->OnStarted(step, bench.now);
    Event event{.kind = Event::Kind::kReply,
                .sent = {bench.now, bench.now},
                .received = {},
                .request = copy.request,
                .bytes = {}};
    simulator_->OnBytes(copy.request, bench.now, Receive());
    const MonoNs deadline = bench.now + copy.timeout;
    ByteList bytes;
    std::size_t length = 0;
    while (length == 0 || bytes.size() < length) {
      if (line_.empty()) {
        const MonoNs due = simulator_->NextDue();
        MoveTo(std::min(std::max(due, bench.now + 1), deadline));
        if (line_.empty() && bench.now >= deadline) break;
      }
      while (!line_.empty() && (length == 0 || bytes.size() < length)) {
        bytes.push_back(line_.front());
        line_.pop_front();
        length = copy.reply_length(bytes);
      }
    }
    if (length == 0 || bytes.size() < length) event.kind = Event::Kind::kTimeout;
    event.received = {bench.now, bench.now};
    event.bytes = bytes;
    bench.device->On(event);
    if (!line_.empty()) Stray();
  }

  void KeepSilence(MonoNs until) {
    MoveTo(until);
    if (!line_.empty()) return Stray();
    bench.device->On(
        {.kind = Event::Kind::kSilent, .sent = {}, .received = {until, until}, .request = {}, .bytes = {}});
  }

  void Stray() {
    const ByteList bytes(line_.begin(), line_.end());
    line_.clear();
    bench.Stray(bytes);
  }

  void MoveTo(MonoNs to) {
    while (simulator_->NextDue() <= to) {
      bench.now = std::max(bench.now, simulator_->NextDue());
      simulator_->OnDue(bench.now, Receive());
    }
    bench.now = std::max(bench.now, to);
  }

  [[nodiscard]] Simulator::Transmit Receive() {
    return [this](Bytes bytes) { line_.insert(line_.end(), bytes.begin(), bytes.end()); };
  }

  // At rest: readings that cover 40 ms, the last at most 120 ms old, all within 0.1 degrees.
  [[nodiscard]] Motion MotionAt(MonoNs at) const {
    Motion motion;
    const auto& samples = bench.output.samples;
    if (samples.empty() || at - samples.back().at.last > 120 * kMillisecond || samples.back().error) return motion;
    motion.standstill = true;
    for (auto sample = samples.rbegin(); sample != samples.rend(); ++sample) {
      motion.standstill = motion.standstill && std::abs(sample->counts - samples.back().counts) <= 36;
      motion.known = samples.back().at.last - sample->at.last >= 40 * kMillisecond;
      if (motion.known) break;
    }
    return motion;
  }

  BusConfig bus_;
  ConfigErrors errors_;
  std::unique_ptr<Simulator> simulator_;
  std::deque<std::uint8_t> line_;
  MonoNs slot_ = 0;
};

TEST(DeviceAgainstModel, ReadsWhatTheShaftDoes) {
  Machine machine("{model: ts5669n127}", "{start_deg: 90, start_turns: 5}");
  machine.Run(200 * kMillisecond);
  EXPECT_NEAR(static_cast<double>(machine.bench.output.samples.back().counts), 131'072.0 / 4, 2);
  EXPECT_EQ(machine.bench.output.samples.back().turns, 5);
  EXPECT_EQ(machine.bench.output.AllErrors(), 0);
  EXPECT_GT(machine.bench.output.samples.size(), 190u);
  EXPECT_EQ(machine.Count("collisions"), 0);
}

struct Standby {
  const char* keys;
  const char* simulate;
  MonoNs lasts;
};

// Spec 5.4, "Standby period at power turning-on": 1 s with an external battery, 1.5 s without. Note 2: "During the power-on
// standby time any external request is not accepted."
const Standby kStandbys[] = {
    {"{model: ts5669n127}", "{start_deg: 90}", kSecond},
    {"{model: ts5669n127, battery: false}", "{start_deg: 90, battery_v: 0}", 1'500 * kMillisecond}};

TEST(DeviceAgainstModel, PoweredOnWithTheDriverTheEncoderIsStartingForItsStandby) {
  for (const Standby& standby : kStandbys) {
    SCOPED_TRACE(standby.keys);
    Machine machine(standby.keys, standby.simulate);
    machine.Set("power", "cycle");
    const MonoNs on = machine.bench.now;
    machine.Run(standby.lasts - kMillisecond);
    EXPECT_TRUE(machine.bench.output.samples.empty());
    EXPECT_EQ(machine.bench.output.AllErrors(), 0) << "its silence is no fault";
    EXPECT_GT(machine.bench.output.starting, 10);
    machine.Run(100 * kMillisecond);
    ASSERT_FALSE(machine.bench.output.samples.empty());
    EXPECT_GE(machine.bench.output.samples.front().at.first - on, standby.lasts);
  }
}

TEST(DeviceAgainstModel, PoweredOnAgainTheEncoderIsReadWhenItsStandbyIsOver) {
  for (const Standby& standby : kStandbys) {
    SCOPED_TRACE(standby.keys);
    Machine machine(standby.keys, standby.simulate);
    machine.Run(2 * kSecond);
    machine.Set("power", "off");
    machine.Run(300 * kMillisecond);
    const std::size_t before = machine.bench.output.samples.size();
    EXPECT_GT(before, 100u);
    machine.Set("power", "on");
    const MonoNs on = machine.bench.now;
    machine.Run(standby.lasts - kMillisecond);
    EXPECT_EQ(machine.bench.output.samples.size(), before);
    machine.Run(100 * kMillisecond);
    ASSERT_GT(machine.bench.output.samples.size(), before);
    EXPECT_GE(machine.bench.output.samples.at(before).at.first - on, standby.lasts);
    EXPECT_NEAR(static_cast<double>(machine.bench.output.samples.back().counts), 131'072.0 / 4, 2);
  }
}

TEST(DeviceAgainstModel, EachOperationHasItsEffectOnce) {
  Machine machine("{model: ts5669n127, eeprom_writable: [10, 11]}", "{start_deg: 63, start_turns: 4660}");
  machine.Run(200 * kMillisecond);
  EXPECT_EQ(machine.Do("zero_single_turn").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("zeroings"), 1);
  EXPECT_EQ(machine.bench.output.jumps, 1);
  EXPECT_LT(
      std::min(machine.bench.output.samples.back().counts, 131'072 - machine.bench.output.samples.back().counts),
      128);
  EXPECT_EQ(machine.Do("reset_turns_and_errors").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("turn_resets"), 1);
  EXPECT_EQ(machine.bench.output.samples.back().turns, 0);
  EXPECT_EQ(machine.Do("clear_errors").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("error_clears"), 1);
  EXPECT_EQ(machine.Count("eeprom_wear"), 1) << "the zero";
  EXPECT_EQ(machine.Do("eeprom_write", {{"address", "10"}, {"data", "A1 05"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Shown("eeprom"), "10=A1 05");
  EXPECT_EQ(machine.Count("eeprom_wear"), 3);
  EXPECT_EQ(machine.bench.output.non_volatile_writes, 3);
  EXPECT_EQ(machine.Do("eeprom_write", {{"address", "10"}, {"data", "A1 05"}}).state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("eeprom_wear"), 3) << "cells that hold their value are not worn";
  EXPECT_EQ(machine.Do("eeprom_backup").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Do("read_all").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Do("read_turns").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Do("read_identity").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("zeroings"), 1);
  EXPECT_EQ(machine.Count("resets_too_early"), 0);
  EXPECT_EQ(machine.Count("resets_broken"), 0);
  EXPECT_EQ(machine.Count("collisions"), 0);
  EXPECT_EQ(machine.bench.output.AllErrors(), 0);
}

// The worst case of each: every cell that is written held something else.
TEST(DeviceAgainstModel, WearsTheMemoryAsOftenAsEachOperationSaysAndCountsEachWrite) {
  std::string cells = "0";
  std::string data = "55";
  for (int cell = 1; cell < 80; ++cell) {
    cells += ", " + std::to_string(cell);
    data += "55";
  }
  for (const OperationSpec& spec : Operations()) {
    Machine machine("{model: ts5669n127, eeprom_writable: [" + cells + "]}", "{start_deg: 63, start_turns: 4660}");
    EXPECT_EQ(machine.bench.settings().write_budget, 100'000) << "spec 6.1.1";
    machine.Run(200 * kMillisecond);
    Arguments arguments;
    for (const ArgumentSpec& argument : spec.arguments) {
      if (argument.name == "address") arguments.emplace_back("address", "0");
      if (argument.name == "data") arguments.emplace_back("data", data);
    }
    EXPECT_EQ(machine.Do(std::string(spec.name), arguments).state, CommandState::kSucceeded) << spec.name;
    const std::int32_t declared = spec.writes == nullptr ? 0 : spec.writes(arguments);
    EXPECT_EQ(declared, spec.name == kZeroSingleTurnName ? 1 : spec.name == kEepromWriteName ? 80 : 0);
    EXPECT_EQ(machine.Count("eeprom_wear"), declared) << spec.name;
    EXPECT_EQ(machine.bench.output.non_volatile_writes, declared) << spec.name;
  }
}

TEST(DeviceAgainstModel, TurningBetweenAnyTwoRequestsStopsTheSequence) {
  for (int after_ms = 0; after_ms < 380; after_ms += 20) {
    Machine machine;
    machine.Run(200 * kMillisecond);
    machine.bench.Begin("zero_single_turn");
    machine.Run(after_ms * kMillisecond);
    ASSERT_EQ(machine.bench.FinalOutcomes(), 0);
    const bool tenth_sent = machine.Count("resets_counted") == 0 && after_ms > 100;
    machine.Set("speed_rpm", "20");
    const Outcome outcome = machine.Finish();
    const bool done = machine.Count("zeroings") > 0;
    EXPECT_NE(outcome.state, CommandState::kIndeterminate);
    if (outcome.state == CommandState::kRejected) {
      EXPECT_FALSE(done) << after_ms;
      EXPECT_EQ(machine.bench.output.jumps, 0);
    } else {
      // Nine requests took 8 x 41 ms: the tenth goes out before its reply can show the motion.
      EXPECT_GE(after_ms, 328);
      EXPECT_TRUE(tenth_sent || outcome.state == CommandState::kFailed);
    }
  }
}

TEST(DeviceAgainstModel, ASequenceThatADeadProcessLeftIsNotCompleted) {
  Machine machine;
  machine.Run(200 * kMillisecond);
  machine.bench.Begin("reset_turns_and_errors");
  while (machine.Count("resets_counted") < 9) machine.Run(1 * kMillisecond);
  // The process dies; another one begins.
  machine.bench.device = MakeDevice(machine.bench.bus(), machine.bench.config(), machine.bench.output);
  machine.bench.output.outcomes.clear();
  machine.bench.LinkUp();
  machine.Run(200 * kMillisecond);
  EXPECT_EQ(machine.Count("resets_counted"), 0);
  EXPECT_EQ(machine.Count("turn_resets"), 0);
  EXPECT_EQ(machine.Do("reset_turns_and_errors").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.Count("turn_resets"), 1);
}

TEST(DeviceAgainstModel, AlarmsComeAndGoWithTheirCause) {
  Machine machine("{model: ts5669n127}", "{start_turns: 7}");
  machine.Run(200 * kMillisecond);
  machine.Set("battery_v", "2.9");
  machine.Run(100 * kMillisecond);
  EXPECT_TRUE(machine.bench.output.Present("battery_alarm"));
  EXPECT_EQ(machine.bench.output.references_lost, 0);
  machine.Set("battery_v", "2.0");
  machine.Run(100 * kMillisecond);
  EXPECT_TRUE(machine.bench.output.Present("battery_error"));
  EXPECT_EQ(machine.bench.output.references_lost, 1);
  EXPECT_EQ(machine.Do("reset_turns_and_errors").state, CommandState::kFailed) << "the battery is still dead";
  EXPECT_EQ(machine.bench.output.references_restored, 0);
  machine.Set("battery_v", "3.6");
  machine.Run(100 * kMillisecond);
  EXPECT_FALSE(machine.bench.output.Present("battery_alarm"));
  EXPECT_TRUE(machine.bench.output.Present("battery_error")) << "latched";
  EXPECT_EQ(machine.Do("clear_errors").state, CommandState::kSucceeded);
  EXPECT_FALSE(machine.bench.output.Present("battery_error"));
  EXPECT_EQ(machine.bench.output.references_restored, 0);
  EXPECT_EQ(machine.Do("reset_turns_and_errors").state, CommandState::kSucceeded);
  EXPECT_EQ(machine.bench.output.references_restored, 1);
}

TEST(DeviceAgainstModel, APowerCycleIsSeenAndTheTagIsReadAgain) {
  Machine machine("{model: ts5669n127, identity: {eeprom_address: 72, bytes: \"A1 05\"}}");
  machine.Run(200 * kMillisecond);
  const std::size_t before = machine.bench.output.samples.size();
  EXPECT_GT(before, 100u);
  machine.Set("power", "off");
  machine.Run(300 * kMillisecond);
  EXPECT_EQ(machine.bench.output.samples.size(), before);
  machine.Set("eeprom", "72=A1 06");  // another unit of the same model
  machine.Set("power", "on");
  machine.Run(3 * kSecond);
  EXPECT_EQ(machine.bench.output.samples.size(), before);
  EXPECT_TRUE(machine.bench.output.Present("wrong_identity"));
  machine.Set("eeprom", "72=A1 05");
  machine.Run(2 * kSecond);
  EXPECT_FALSE(machine.bench.output.Present("wrong_identity"));
  EXPECT_GT(machine.bench.output.samples.size(), before);
}

// Faults of the line: every order ends in one truthful outcome, and the device never talks into a reply.
TEST(DeviceAgainstModel, OnABadLineEveryOutcomeIsTruthful) {
  int succeeded = 0;
  for (const char* fault : {"intermittent 0.03", "bit_flip 0.001", "request_flip 0.003"}) {
    for (int seed = 1; seed <= 40; ++seed) {
      Machine machine("{model: ts5669n127, eeprom_writable: [10, 11]}",
                      "{start_deg: 63, start_turns: 7, seed: " + std::to_string(seed) + "}");
      machine.Run(200 * kMillisecond);
      const std::string words = fault;
      const std::size_t space = words.find(' ');
      machine.Set("fault", words.substr(0, space) + ":" + words.substr(space + 1));
      const Outcome reset = machine.Do("reset_turns_and_errors");
      const bool done = machine.Count("turn_resets") == 1;
      if (reset.state == CommandState::kSucceeded) {
        EXPECT_TRUE(done) << reset.text;
      }
      if (reset.state == CommandState::kRejected) {
        EXPECT_FALSE(done) << reset.text;
      }
      if (reset.text.find("nothing was done") != std::string::npos) {
        EXPECT_FALSE(done) << reset.text;
      }
      succeeded += reset.state == CommandState::kSucceeded ? 1 : 0;
      const Outcome write = machine.Do("eeprom_write", {{"address", "10"}, {"data", "A1 05"}});
      if (write.state == CommandState::kSucceeded) {
        EXPECT_EQ(machine.Shown("eeprom"), "10=A1 05");
      }
      EXPECT_LE(machine.Count("eeprom_writes"), 2);
      // The rest of a request whose first byte came damaged can meet the answer to that byte: physics.
      if (words.substr(0, space) != "request_flip") {
        EXPECT_EQ(machine.Count("collisions"), 0);
      }
    }
  }
  EXPECT_GT(succeeded, 10);
}

}  // namespace
}  // namespace axlecast::tformat
