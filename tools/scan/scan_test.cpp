#include "tools/scan/scan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "core/config/load.h"
#include "drivers/runtime/bus/transactor.h"
#include "tests/support/fake_clock.h"
#include "tests/support/scripted_link.h"
#include "tests/support/simulator_link.h"

namespace axlecast {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// A simulated bus of a machine's file, in virtual time, as a scan sees it. A pty carries no parity, so neither does this.
class SimulatedLine final : public ScanLine {
 public:
  explicit SimulatedLine(const std::string& bus) {
    ConfigErrors errors("test.yaml");
    machine_ = ParseConfig("machine: test\nbuses:\n  line:\n    simulate: true\n" + bus, errors);
    if (machine_) simulator_ = MakeSimulator(*machine_, machine_->buses.at(0), errors);
    EXPECT_TRUE(errors.empty()) << errors.Text();
    link_ = std::make_unique<SimulatorLink>(clock, *simulator_, 9'600);
    EXPECT_EQ(ErrorText(link_->Open()), "");
    transactor_ = std::make_unique<SerialTransactor>(*link_, clock, false, nullptr);
  }

  [[nodiscard]] bool Set(const ProbeTrial& trial) override {
    if (trial.line.baud == cannot_make) return false;
    const bool set = link_->SetBaud(trial.line.baud);
    const Event* stray = transactor_->FindStray();
    while (stray != nullptr && stray->kind != Event::Kind::kLinkDown) stray = transactor_->FindStray();
    return set || stray != nullptr;  // the next step reports a lost line
  }
  [[nodiscard]] Transactor& transactor() override { return *transactor_; }

  // The sum of a quantity over all devices.
  [[nodiscard]] int Sum(const std::string& quantity) const {
    int sum = 0;
    for (const DeviceConfig& device : machine_->buses.at(0).devices) {
      for (const auto& [name, value] : simulator_->State(device.name, clock.Now())) {
        if (name == quantity) sum += std::stoi(value);
      }
    }
    return sum;
  }
  [[nodiscard]] std::int64_t writes() const { return link_->writes(); }
  void Unplug() { link_->Unplug(); }

  FakeClock clock;
  std::int64_t cannot_make = 0;

 private:
  std::optional<MachineConfig> machine_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<SimulatorLink> link_;
  std::unique_ptr<SerialTransactor> transactor_;
};

ScanReport ScanOf(SimulatedLine& line, const ProbeScope& scope = {}, bool may_ask = true) {
  ScanHooks hooks;
  hooks.may_ask = [may_ask] { return may_ask; };
  return RunScan(line, line.clock, PlanScan(FamilyProbes(), ScanLineKind::kSerial, scope), hooks);
}

// Parses the file that a scan writes. It must be valid.
MachineConfig Written(const ScanReport& report) {
  ConfigErrors errors("scanned.yaml");
  const std::string yaml = ScanYaml({.port = "/dev/ttyUSB0"}, report);
  std::optional<MachineConfig> machine = ParseConfig(yaml, errors);
  EXPECT_TRUE(machine) << errors.Text() << yaml;
  return machine.value_or(MachineConfig{});
}

std::string FamilyOf(const MachineConfig& machine) {
  return machine.buses.empty() ? "" : std::string(machine.buses[0].family->name);
}

TEST(Scan, FindsATFormatEncoder) {
  SimulatedLine line("    family: tformat\n    devices: {axis1: {model: ts5669n127}}\n");
  const ScanReport report = ScanOf(line);
  ASSERT_THAT(report.found, SizeIs(1));
  EXPECT_EQ(report.found[0].finding.confidence, Confidence::kSure);
  const MachineConfig machine = Written(report);
  EXPECT_EQ(FamilyOf(machine), "tformat");
  EXPECT_EQ(machine.buses.at(0).link.line.baud, 2'500'000);
  EXPECT_EQ(machine.buses.at(0).devices.at(0).model, "ts5669n127");
  EXPECT_EQ(line.Sum("writes"), 0);
}

TEST(Scan, FindsModbusEncodersAtEveryRateAndAddress) {
  for (const char* baud : {"2400", "4800", "9600", "19200", "57600"}) {
    SimulatedLine line("    family: saa_modbus\n    link: {baud: " + std::string(baud) +
                       "}\n    devices: {a: {bits: 14, address: 7}, b: {bits: 24, address: 200}}\n");
    const ScanReport report = ScanOf(line);
    ASSERT_THAT(report.found, SizeIs(2)) << baud;
    const MachineConfig machine = Written(report);
    EXPECT_EQ(FamilyOf(machine), "saa_modbus");
    EXPECT_EQ(std::to_string(machine.buses.at(0).link.line.baud), baud);
    EXPECT_THAT(machine.buses.at(0).devices, SizeIs(2));
    EXPECT_EQ(line.Sum("writes"), 0);
    EXPECT_EQ(line.Sum("short_gaps"), 0);
  }
}

TEST(Scan, FindsScUnits) {
  SimulatedLine line("    family: tsubaki_sc\n    devices: {a: {address: 1}, b: {address: 16}}\n");
  const ScanReport report = ScanOf(line);
  ASSERT_THAT(report.found, SizeIs(2)) << ScanText({.port = "x"}, report);
  const MachineConfig machine = Written(report);
  EXPECT_EQ(FamilyOf(machine), "tsubaki_sc");
  EXPECT_THAT(machine.buses.at(0).devices, SizeIs(2));
  EXPECT_EQ(line.Sum("writes"), 0);
  EXPECT_EQ(line.Sum("dropped_early"), 0);
}

TEST(Scan, FindsAStreamWithoutSendingAnything) {
  for (const char* baud : {"9600", "115200", "921600"}) {
    SimulatedLine line("    family: saa_serial\n    mode: timing\n    refresh_hz: 100\n    link: {baud: " +
                       std::string(baud) + "}\n    devices: {a: {bits: 20}}\n");
    const ScanReport report = ScanOf(line, {}, false);
    ASSERT_THAT(report.found, SizeIs(1)) << baud << ScanText({.port = "x"}, report);
    EXPECT_FALSE(report.asked);
    EXPECT_EQ(FamilyOf(Written(report)), "saa_serial");
    EXPECT_EQ(std::to_string(report.found[0].trial.line.baud), baud);
    EXPECT_EQ(line.Sum("unknown") + line.Sum("noise"), 0);
  }
}

constexpr const char* kPolled =
    "    family: saa_serial\n    mode: bus\n    zero_clearing: true\n    link: {baud: 115200}\n"
    "    devices: {a: {bits: 14, address: 1}, b: {bits: 26, address: 15}}\n";

TEST(Scan, AsksPolledEncodersOnlyAtANamedRate) {
  SimulatedLine blind(kPolled);
  EXPECT_THAT(ScanOf(blind).found, IsEmpty());
  EXPECT_EQ(blind.Sum("requests") + blind.Sum("zeroings"), 0);

  SimulatedLine named(kPolled);
  const ScanReport report = ScanOf(named, {.rates = {115'200}});
  ASSERT_THAT(report.found, SizeIs(2));
  EXPECT_THAT(Written(report).buses.at(0).devices, SizeIs(2));
  EXPECT_EQ(named.Sum("zeroings"), 0);
}

TEST(Scan, SendsNothingUnlessItMay) {
  SimulatedLine line("    family: saa_modbus\n    devices: {a: {bits: 14, address: 1}}\n");
  const ScanReport report = ScanOf(line, {}, false);
  EXPECT_THAT(report.found, IsEmpty());
  EXPECT_FALSE(report.asked);
  EXPECT_EQ(line.writes(), 0);
  EXPECT_THAT(report.notes, Each(HasSubstr("nothing was sent")));
}

TEST(Scan, AsksNothingWhereSomebodySpeaksThatItDoesNotKnow) {
  SimulatedLine line(
      "    family: saa_serial\n    mode: timing\n    refresh_hz: 100\n    link: {baud: 31250}\n"
      "    devices: {a: {bits: 20}}\n");
  const ScanReport report = ScanOf(line);
  EXPECT_THAT(report.found, IsEmpty());
  EXPECT_FALSE(report.asked);
  EXPECT_EQ(line.writes(), 0);
  EXPECT_THAT(report.notes, Each(HasSubstr("another master")));
}

TEST(Scan, AStopEndsItWithWhatWasFoundUntilThen) {
  SimulatedLine line(
      "    family: saa_modbus\n    devices: {a: {bits: 14, address: 1}, b: {bits: 14, address: 2}}\n");
  bool stop = false;
  ScanHooks hooks;
  hooks.may_ask = [] { return true; };
  hooks.stop = [&] { return stop; };
  hooks.progress = [&](const PlannedTrial& planned, double done, MonoNs) {
    stop = planned.trial.line.baud == 19'200 && done > 0.03;  // past the first of 32 addresses
  };
  const ScanReport report = RunScan(line, line.clock, PlanScan(FamilyProbes(), ScanLineKind::kSerial, {}), hooks);
  EXPECT_FALSE(report.complete);
  EXPECT_THAT(report.found, SizeIs(1));
}

TEST(Scan, ARateThatThePortCannotMakeIsNoted) {
  SimulatedLine line("    family: saa_modbus\n    devices: {a: {bits: 14, address: 1}}\n");
  line.cannot_make = 2'500'000;
  const ScanReport report = ScanOf(line);
  EXPECT_THAT(report.found, SizeIs(1));
  EXPECT_THAT(report.notes, testing::ElementsAre(HasSubstr("does not support")));
}

TEST(Scan, ALostLineEndsIt) {
  SimulatedLine line("    family: saa_modbus\n    devices: {a: {bits: 14, address: 1}}\n");
  ScanHooks hooks;
  hooks.may_ask = [&] {
    line.Unplug();
    return true;
  };
  const ScanReport report = RunScan(line, line.clock, PlanScan(FamilyProbes(), ScanLineKind::kSerial, {}), hooks);
  EXPECT_FALSE(report.complete);
  EXPECT_THAT(report.found, IsEmpty());
}

// A line in virtual time whose other end answers one request at one rate, late.
class LateLine final : public ScanLine {
 public:
  LateLine(std::int64_t baud, std::vector<std::uint8_t> request, std::vector<std::uint8_t> reply, MonoNs late) {
    EXPECT_EQ(ErrorText(link_.Open()), "");
    link_.SetPeer([=, this](Bytes bytes) -> std::vector<ScriptedLink::Burst> {
      asked += 1;
      if (link_.baud() != baud || !std::equal(bytes.begin(), bytes.end(), request.begin(), request.end()))
        return {};
      ++answered;
      return {{late, reply}};
    });
  }
  [[nodiscard]] bool Set(const ProbeTrial& trial) override { return link_.SetBaud(trial.line.baud); }
  [[nodiscard]] Transactor& transactor() override { return transactor_; }

  FakeClock clock;
  int asked = 0;
  int answered = 0;

 private:
  ScriptedLink link_{clock};
  SerialTransactor transactor_{link_, clock, false, nullptr};
};

// What an adapter has received at one rate it may hand over when the next rate is tried.
TEST(Scan, ALateAnswerIsNotTakenForOneAtTheNextRate) {
  for (const MonoNs late : {100 * kMillisecond, 150 * kMillisecond, 200 * kMillisecond, 300 * kMillisecond,
                            400 * kMillisecond, 490 * kMillisecond}) {
    // SAA manual 5.1.7 (5), address 5.
    LateLine line(19'200, {0x05, 0x03, 0x00, 0x00, 0x00, 0x01, 0x85, 0x8E},
                  {0x05, 0x03, 0x02, 0x01, 0x7F, 0x09, 0xF4}, late);
    ScanHooks hooks;
    hooks.may_ask = [] { return true; };
    const ProbeScope scope{.first_address = 5, .last_address = 5};
    const ScanReport report =
        RunScan(line, line.clock, PlanScan(FamilyProbes(), ScanLineKind::kSerial, scope), hooks);
    EXPECT_THAT(report.found, IsEmpty()) << late << ScanText({.port = "x"}, report);
    EXPECT_GE(line.answered, 1);
    EXPECT_GT(line.asked, 10) << "the other rates are tried all the same";
  }
}

TEST(ScanPlan, ListensFirstThenAsksTheShortestFirst) {
  const std::vector<PlannedTrial> plan = PlanScan(FamilyProbes(), ScanLineKind::kSerial, {.rates = {9'600}});
  ASSERT_GT(plan.size(), 3U);
  for (std::size_t i = 1; i < plan.size(); ++i) {
    EXPECT_LE(plan[i - 1].trial.asks, plan[i].trial.asks);
    if (!plan[i - 1].trial.asks) continue;
    EXPECT_LE(plan[i - 1].trial.longest, plan[i].trial.longest);
  }
}

TEST(ScanText, JsonHoldsTheFileAndEveryFinding) {
  SimulatedLine line("    family: tformat\n    devices: {axis1: {model: ts5669n127}}\n");
  const ScanReport report = ScanOf(line);
  const nlohmann::ordered_json json = ScanJson({.port = "/dev/ttyUSB0"}, report);
  EXPECT_EQ(json["found"].size(), 1U);
  EXPECT_EQ(json["found"][0]["confidence"], "sure");
  EXPECT_EQ(json["found"][0]["link"]["port"], "/dev/ttyUSB0");
  EXPECT_TRUE(json["complete"].get<bool>());
  EXPECT_EQ(json["yaml"], ScanYaml({.port = "/dev/ttyUSB0"}, report));
}

}  // namespace
}  // namespace axlecast
