#include "drivers/runtime/process/driver.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_t.hpp>
#include <map>
#include <random>

#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "tests/conformance/example_buses.h"
#include "tests/conformance/example_link.h"
#include "tests/support/counting_family.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 42;
// Longer than any first reading and any pause of a device that was silent.
constexpr MonoNs kPatience = 120 * kSecond;

// A whole driver on its simulator, in virtual time.
class DriverConformance : public ExampleTest {
 protected:
  DriverConformance() {
    if (!simulator_) return;
    link_ = std::make_unique<ExampleLink>(*bus_, clock_, *simulator_);
    DriverPorts ports{.secrets = &secrets_,
                      .clock = &clock_,
                      .data = &data_,
                      .commands = &commands_,
                      .log = [](LogLevel, std::string_view) {},
                      .link_warnings = {}};
    link_->PlugInto(ports);
    driver_ = std::make_unique<Driver>(*bus_, UnsignedBridge(), Origin{.boot_id = kBoot}, std::move(ports));
  }
  void SetUp() override { ASSERT_TRUE(driver_); }

  void RunFor(MonoNs time) {
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) driver_->RunOnce();
  }
  [[nodiscard]] device_info_t Info(const std::string& device) const {
    const auto all = data_.All<device_info_t>("DEVICE/" + device);
    return all.empty() ? device_info_t{} : all.back();
  }
  [[nodiscard]] bool All(std::int8_t state) const {
    return std::all_of(bus_->devices.begin(), bus_->devices.end(),
                       [&](const DeviceConfig& device) { return Info(device.name).state == state; });
  }
  [[nodiscard]] bool Reach(std::int8_t state) {
    for (const MonoNs end = clock_.Now() + kPatience; clock_.Now() < end && !All(state);) {
      data_.Clear();
      RunFor(2 * kSecond);
    }
    return All(state);
  }
  [[nodiscard]] std::int64_t Readings(const std::string& device) const {
    return bus_->family->has_position
               ? static_cast<std::int64_t>(data_.All<position_t>("POSITION/" + device).size())
               : static_cast<std::int64_t>(data_.All<motor_health_t>("MOTOR/" + device).size());
  }
  // The states that the driver reported of the order with this number.
  [[nodiscard]] std::vector<std::int8_t> StatesOf(std::uint32_t number) const {
    std::vector<std::int8_t> states;
    for (const auto& status : commands_.All<driver_status_t>("DRIVER_STATUS/" + bus_->name)) {
      if (status.kind == driver_status_t::KIND_STATUS && IdOf(status.id) == NumberedId(number)) {
        states.push_back(status.state);
      }
    }
    return states;
  }

  FakeClock clock_;
  MemorySink data_;
  MemorySink commands_;
  std::unique_ptr<ExampleLink> link_;
  std::unique_ptr<Driver> driver_;
};

TEST_P(DriverConformance, EveryDeviceIsReadWithoutAnError) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE)) << Info(bus_->devices[0].name).reason;
  std::map<std::string, device_info_t> before;
  for (const DeviceConfig& device : bus_->devices) before[device.name] = Info(device.name);
  data_.Clear();
  RunFor(10 * kSecond);
  for (const DeviceConfig& device : bus_->devices) {
    EXPECT_GT(Readings(device.name), 1) << device.name;
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
      EXPECT_EQ(Info(device.name).errors[kind], before[device.name].errors[kind])
          << device.name << ' ' << ErrorName(static_cast<ErrorKind>(kind));
    }
    for (const position_t& position : data_.All<position_t>("POSITION/" + device.name)) {
      EXPECT_TRUE((position.flags & position_t::FLAG_VALID) != 0);
      EXPECT_TRUE((position.flags & position_t::FLAG_SIMULATED) != 0);
    }
  }
}

TEST_P(DriverConformance, APulledCableIsASilenceAndComesBack) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE));
  link_->cable().Unplug();
  RunFor(5 * kSecond);
  EXPECT_TRUE(All(device_info_t::STATE_OFFLINE));
  data_.Clear();
  const std::int64_t writes = link_->cable().writes();
  RunFor(5 * kSecond);
  EXPECT_EQ(link_->cable().writes(), writes);
  for (const DeviceConfig& device : bus_->devices) EXPECT_EQ(Readings(device.name), 0);
  link_->cable().Plug();
  EXPECT_TRUE(Reach(device_info_t::STATE_ONLINE));
}

TEST_P(DriverConformance, ALineThatSwallowsEverythingIsOfflineAndIsNotFlooded) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE));
  link_->cable().SetDamage([](std::vector<std::uint8_t>& bytes) { bytes.clear(); });
  ASSERT_TRUE(Reach(device_info_t::STATE_OFFLINE)) << Info(bus_->devices[0].name).reason;
  const std::int64_t writes = link_->cable().writes();
  const std::int64_t waits = link_->cable().waits();
  RunFor(10 * kSecond);
  EXPECT_LT(link_->cable().writes() - writes, 1'000);
  EXPECT_LT(link_->cable().waits() - waits, 100'000);
  link_->cable().SetDamage({});
  EXPECT_TRUE(Reach(device_info_t::STATE_ONLINE));
}

// What is decoded from noise is judged by each family's own tests; here it must end, be counted and pass over.
TEST_P(DriverConformance, NoiseIsCountedAndOver) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE));
  std::mt19937 random(7);
  link_->cable().SetDamage([&random](std::vector<std::uint8_t>& bytes) {
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    if (random() % 3 == 0) bytes.resize(random() % 40);
  });
  RunFor(20 * kSecond);
  std::int64_t errors = 0;
  for (const DeviceConfig& device : bus_->devices) {
    for (const std::int64_t count : Info(device.name).errors) errors += count;
  }
  EXPECT_GT(errors, 0);
  link_->cable().SetDamage({});
  EXPECT_TRUE(Reach(device_info_t::STATE_ONLINE));
}

// Called with no arguments but empty ones, so that most are refused; whatever it does, it does once.
TEST_P(DriverConformance, EveryOperationHasExactlyOneOutcome) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE));
  std::uint32_t number = 0;
  for (const OperationSpec& operation : bus_->family->operations) {
    for (const bool with_arguments : {false, true}) {
      if (with_arguments && operation.arguments.empty()) continue;
      ++number;
      driver_order_t order =
          OrderMessage(kBoot, number, NumberedId(number), bus_->devices[0].name, std::string(operation.name));
      for (const ArgumentSpec& argument : operation.arguments) {
        if (with_arguments && order.arguments.size() < 16)
          order.arguments.push_back({std::string(argument.name), "?"});
      }
      order.n_arguments = static_cast<std::int8_t>(order.arguments.size());
      driver_->command_server().OnDriverCommand(Enveloped(order));
      for (const MonoNs end = clock_.Now() + kPatience; clock_.Now() < end;) {
        RunFor(kSecond);
        if (!StatesOf(number).empty() && IsFinalState(StatesOf(number).back())) break;
      }
      const std::vector<std::int8_t> states = StatesOf(number);
      ASSERT_FALSE(states.empty()) << operation.name;
      EXPECT_EQ(std::count_if(states.begin(), states.end(), IsFinalState), 1) << operation.name;
      EXPECT_TRUE(IsFinalState(states.back())) << operation.name;
      EXPECT_NE(states.back(), S::STATE_INDETERMINATE) << operation.name;
      data_.Clear();
    }
  }
  RunFor(10 * kSecond);
  EXPECT_FALSE(All(device_info_t::STATE_OFFLINE));
}

TEST_P(DriverConformance, AnOrderEndsAlsoWhenTheLineIsLost) {
  ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE));
  std::uint32_t number = 100;
  for (const OperationSpec& operation : bus_->family->operations) {
    ++number;
    driver_->command_server().OnDriverCommand(Enveloped(
        OrderMessage(kBoot, number, NumberedId(number), bus_->devices[0].name, std::string(operation.name))));
    RunFor(30 * kMillisecond);
    link_->cable().Unplug();
    RunFor(30 * kSecond);
    link_->cable().Plug();
    ASSERT_FALSE(StatesOf(number).empty());
    EXPECT_TRUE(IsFinalState(StatesOf(number).back())) << operation.name;
    ASSERT_TRUE(Reach(device_info_t::STATE_ONLINE)) << operation.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Family, DriverConformance, testing::ValuesIn(ExampleBuses()), NameOf);

}  // namespace
}  // namespace axlecast
