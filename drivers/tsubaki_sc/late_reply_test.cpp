// Whole buses on their simulator, in virtual time, with replies that come too late: what the device-side checks must
// never let through.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <axlecast/wire_t.hpp>
#include <random>

#include "core/config/config_map.h"
#include "core/config/load.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/tsubaki_sc/family.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/memory_sink.h"
#include "tests/support/recording_output.h"
#include "tests/support/simulator_link.h"

namespace axlecast::tsubaki_sc {
namespace {

class NoObserver final : public BusObserver {
  void OnLink(bool, std::string_view, MonoNs) override {}
};

constexpr const char* kPassword1 = "Zq7!xyzw";
constexpr const char* kPassword2 = "Another~Secret#2";

// Three units of 100, 200 and 300 V, all captured.
class LateReplyTest : public testing::Test {
 protected:
  LateReplyTest() {
    ConfigErrors errors("m.yaml");
    machine_ = ParseConfig(R"(
machine: m
buses:
  motors:
    family: tsubaki_sc
    simulate:
      gm1: {voltage_v: 100, password: "Zq7!xyzw"}
      gm2: {voltage_v: 200}
      gm3: {voltage_v: 300}
    devices:
      gm1: {address: 1, passwords: {one: {file: /1}, two: {file: /2}}, password: one, permit: not_required}
      gm2: {address: 2, permit: not_required}
      gm3: {address: 3, permit: not_required}
)",
                           errors);
    if (!machine_) throw std::runtime_error(errors.Text());
    simulator_ = MakeSimulator(*machine_, bus_config(), errors);
    if (!simulator_) throw std::runtime_error(errors.Text());
    secrets_.files = {{"/1", kPassword1}, {"/2", kPassword2}};
    link_ = std::make_unique<SimulatorLink>(clock_, *simulator_, 9'600);
    time_.Update(clock_.Now(), clock_.UtcMicroseconds());
    BusSettings settings;
    settings.schedule.pacing = bus_config().family_bus->pacing;
    settings.schedule.line = bus_config().link.line;
    bus_ = std::make_unique<Bus>(settings, *link_, clock_, observer_, &log_);
    for (std::size_t i = 0; i < 3; ++i) {
      const DeviceConfig& device = bus_config().devices[i];
      devices_.push_back(MakeDevice(bus_config(), device, outputs_[i], secrets_));
      bus_->Add(*devices_.back());
    }
  }

  [[nodiscard]] const BusConfig& bus_config() const { return machine_->buses[0]; }
  void RunFor(MonoNs time) {
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) bus_->RunOnce(end);
  }
  void SetFault(const char* device, const std::string& fault) {
    ASSERT_EQ(ErrorText(simulator_->Set(device, "fault", fault, clock_.Now())), "");
  }
  void Begin(const std::string& operation, Arguments arguments = {}) {
    devices_[0]->Begin(
        {.id = {++orders_}, .operation = operation, .arguments = std::move(arguments), .begin_by = kNever},
        clock_.Now());
  }

  FakeClock clock_;
  Timebase time_;
  MemorySink sink_;
  WireLog log_{"motors", Origin{.boot_id = 1}, time_, sink_, {}};
  NoObserver observer_;
  FixedSecrets secrets_;
  std::optional<MachineConfig> machine_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<SimulatorLink> link_;
  std::array<RecordingOutput, 3> outputs_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::unique_ptr<Bus> bus_;
  std::uint8_t orders_ = 0;
};

// The trap of libmodbus: after a time-out, a late reply was taken for that of a different address.
TEST_F(LateReplyTest, NeverBecomesAnotherUnitsValueNorAnotherQuantity) {
  std::mt19937 random(5);
  for (int round = 0; round < 300; ++round) {
    const int delay_ms = 120 + static_cast<int>(random() % 400);
    SetFault("gm2", random() % 3 == 0 ? "none" : "delayed:" + std::to_string(delay_ms));
    if (round % 10 == 0) {
      ASSERT_EQ(ErrorText(simulator_->Set("gm2", "trip", "overheat", clock_.Now())), "");
    }
    if (round % 10 == 5) {
      ASSERT_EQ(ErrorText(simulator_->Set("gm2", "power", "cycle", clock_.Now())), "");
    }
    RunFor(kSecond + static_cast<MonoNs>(random() % 1'000) * kMillisecond);
  }
  SetFault("gm2", "none");
  RunFor(60 * kSecond);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GT(outputs_[i].motors.size(), 50U) << i;
    for (const MotorReading& motor : outputs_[i].motors) {
      if (!motor.has_analog()) continue;
      ASSERT_FLOAT_EQ(motor.voltage_v, 100.0F * static_cast<float>(i + 1));
      ASSERT_EQ(motor.status_bits & ~0x20, 0);
    }
    for (const TripRecord& trip : outputs_[i].trips) {
      ASSERT_EQ(i, 1U);
      for (const float volts : trip.samples[0]) {
        ASSERT_TRUE((trip.valid_mask & 1) == 0 || volts == 200.0F || volts == 0.0F) << volts;
      }
    }
  }
  EXPECT_GT(outputs_[1].errors.size(), 50U) << "they were late";
  EXPECT_GT(outputs_[1].trips.size(), 2U);
}

bool Contains(Bytes bytes, std::string_view text) {
  for (std::size_t at = 0; at + text.size() <= bytes.size(); ++at) {
    if (std::equal(text.begin(), text.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at))) return true;
  }
  return false;
}

// Whatever becomes of the exchange that carries it, also when the reply that holds it is late and comes as a stray or
// in place of the reply to another unit.
TEST_F(LateReplyTest, APasswordIsNeverInACapture) {
  RunFor(30 * kSecond);
  const std::vector<std::pair<std::string, Arguments>> orders = {{"log_in", {}},
                                                                 {"set_password", {{"name", "two"}}},
                                                                 {"check_password", {{"name", "two"}}},
                                                                 {"set_password", {{"name", "one"}}}};
  for (int delay_ms = 100; delay_ms < 700; delay_ms += 10) {
    for (const auto& [operation, arguments] : orders) {
      // What is delayed comes before what is not: a line does not change the order of its bytes.
      SetFault("gm1", "off");
      RunFor(kSecond);
      SetFault("gm1", "none");
      RunFor(3 * kSecond);
      Begin(operation, arguments);
      RunFor(static_cast<MonoNs>(delay_ms % 300) * kMillisecond);
      SetFault("gm1", "delayed:" + std::to_string(delay_ms));
      RunFor(3 * kSecond);
    }
  }
  log_.Flush();
  const auto messages = sink_.All<wire_t>("WIRE/motors");
  ASSERT_GT(messages.size(), 100U);
  int masked = 0;
  for (const wire_t& message : messages) {
    for (const wire_record_t& record : message.records) {
      // Half of it would be too much.
      for (const char* secret : {kPassword1, kPassword2})
        ASSERT_FALSE(Contains(record.data, std::string_view(secret).substr(0, 4)))
            << HexText(record.data) << " direction " << int{record.direction} << " flags " << int{record.flags};
      if ((record.flags & wire_record_t::FLAG_REDACTED) != 0) ++masked;
    }
  }
  EXPECT_GT(masked, 100);
  for (const auto& [id, outcome] : outputs_[0].outcomes) {
    EXPECT_THAT(outcome.text,
                testing::Not(testing::AnyOf(testing::HasSubstr(kPassword1), testing::HasSubstr(kPassword2))));
  }
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
