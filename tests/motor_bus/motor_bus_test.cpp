#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <random>

#include "core/command/commands.h"
#include "core/config/load.h"
#include "core/messages/enum_names.h"
#include "drivers/runtime/command/driver_command_server.h"
#include "drivers/runtime/process/driver.h"
#include "tests/support/counting_family.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/memory_sink.h"
#include "tests/support/simulator_link.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 42;
// Device facts: two requests of 7 and 5 registers at 9600 8E1, 5 ms before each answer, 0.1 s after each (reading A).
// 2 x 8 + 19 + 15 characters of 11 bits.
constexpr MonoNs kLiveCycle = 50 * INT64_C(11'000'000'000) / 9'600 + 2 * (5 + 100) * kMillisecond;

// `units` SC units on one bus, their driver, and their simulator at the wire's pace.
class MotorBusTest : public testing::Test {
 protected:
  void Make(int units, const std::string& device_keys = "", const std::string& bus_keys = "") {
    std::string text =
        "machine: m\nbuses:\n  motors:\n    family: tsubaki_sc\n    simulate: true\n" + bus_keys + "    devices:\n";
    for (int i = 1; i <= units; ++i) {
      text += "      gm" + std::to_string(i) + ": {address: " + std::to_string(i) +
              ", permit: not_required, passwords: {usual: {file: /p}}, password: usual" + device_keys + "}\n";
    }
    ConfigErrors errors("m.yaml");
    auto machine = ParseConfig(text, errors);
    ASSERT_TRUE(machine) << errors.Text();
    machine_ = std::make_unique<MachineConfig>(std::move(*machine));
    const BusConfig& bus = machine_->buses[0];
    simulator_ = MakeSimulator(*machine_, bus, errors);
    ASSERT_TRUE(simulator_) << errors.Text();
    secrets_.any = "password";
    link_ = std::make_unique<SimulatorLink>(clock_, *simulator_, bus.link.line.baud);
    driver_ = std::make_unique<Driver>(bus, UnsignedBridge(), Origin{.boot_id = kBoot},
                                       DriverPorts{.link = link_.get(),
                                                   .lines = nullptr,
                                                   .secrets = &secrets_,
                                                   .clock = &clock_,
                                                   .data = &data_,
                                                   .commands = &commands_,
                                                   .log = [](LogLevel, std::string_view) {},
                                                   .link_warnings = {}});
  }
  void RunFor(MonoNs time) {
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) driver_->RunOnce();
  }
  // Everything that is read once after a start is read.
  void Settle() {
    RunFor(120 * kSecond);
    data_.Clear();
  }
  void Set(const std::string& device, const std::string& key, const std::string& value) {
    ASSERT_EQ(ErrorText(simulator_->Set(device, key, value, clock_.Now())), "");
  }
  [[nodiscard]] std::vector<motor_health_t> Motor(int unit) const {
    return data_.All<motor_health_t>("MOTOR/gm" + std::to_string(unit));
  }
  [[nodiscard]] std::vector<trip_log_t> Trips(int unit = 1) const {
    return data_.All<trip_log_t>("TRIP/gm" + std::to_string(unit));
  }
  // Mean time between two readings of each unit but `without`, over `time`.
  [[nodiscard]] double MeanCycle(int units, MonoNs time, int without = 0) {
    data_.Clear();
    RunFor(time);
    double sum = 0;
    int counted = 0;
    for (int unit = 1; unit <= units; ++unit) {
      if (unit == without) continue;
      const auto readings = Motor(unit);
      EXPECT_GT(readings.size(), 1U) << unit;
      if (readings.size() < 2) continue;
      sum += static_cast<double>(readings.back().mono_ns - readings.front().mono_ns) /
             static_cast<double>(readings.size() - 1);
      ++counted;
    }
    return sum / counted;
  }
  void Order(std::uint32_t number, const std::string& operation, std::vector<argument_t> arguments = {}) {
    driver_order_t order = OrderMessage(kBoot, number, NumberedId(number), "gm1", operation);
    order.valid_ms = 60'000;
    order.arguments = std::move(arguments);
    order.n_arguments = static_cast<std::int8_t>(order.arguments.size());
    driver_->command_server().OnDriverCommand(Enveloped(order));
  }
  [[nodiscard]] driver_status_t StatusOf(std::uint32_t number) const {
    driver_status_t found{};
    for (const auto& status : commands_.All<driver_status_t>("DRIVER_STATUS/motors")) {
      if (status.kind == driver_status_t::KIND_STATUS && IdOf(status.id) == NumberedId(number)) found = status;
    }
    return found;
  }

  FakeClock clock_;
  std::unique_ptr<MachineConfig> machine_;
  std::unique_ptr<Simulator> simulator_;
  MemorySink data_;
  MemorySink commands_;
  FixedSecrets secrets_;
  std::unique_ptr<SimulatorLink> link_;
  std::unique_ptr<Driver> driver_;
};

TEST_F(MotorBusTest, SixteenUnitsAreReadAtTheTheoreticalRate) {
  Make(16);
  Settle();
  const double ideal = static_cast<double>(16 * kLiveCycle);
  EXPECT_NEAR(ideal * 1e-9, 4.28, 0.005);
  EXPECT_LE(MeanCycle(16, 20 * 16 * kLiveCycle), ideal / 0.99);
}

TEST_F(MotorBusTest, AUnitThatIsGoneCostsTheOthersLittle) {
  Make(16);
  Settle();
  Set("gm7", "power", "off");
  const double alive = MeanCycle(16, 20 * 16 * kLiveCycle, 7);
  EXPECT_LE(alive, static_cast<double>(16 * kLiveCycle) / 0.95);
  Set("gm7", "power", "on");
  data_.Clear();
  RunFor(60 * kSecond);
  EXPECT_GT(Motor(7).size(), 2U) << "it comes back by itself";
}

TEST_F(MotorBusTest, OnePercentOfDamagedRepliesCostsLittleAndIsNeverPublished) {
  Make(4);
  Settle();
  std::mt19937 random(3);
  link_->SetDamage([&random](std::vector<std::uint8_t>& bytes) {
    if (random() % 100 == 0) bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
  });
  const double ideal = static_cast<double>(4 * kLiveCycle);
  EXPECT_LE(MeanCycle(4, 200 * 4 * kLiveCycle), ideal / 0.95);
}

TEST_F(MotorBusTest, ATripIsPublishedAndItsLogFollows) {
  Make(1);
  Settle();
  Set("gm1", "trip", "overheat");
  const MonoNs tripped = clock_.Now();
  RunFor(kLiveCycle + 150 * kMillisecond);
  const auto motors = Motor(1);
  ASSERT_FALSE(motors.empty());
  EXPECT_EQ(motors.back().trip_count, 1);
  EXPECT_EQ(motors.back().trip_factor[0], 0x20);
  const auto first =
      std::find_if(motors.begin(), motors.end(), [](const motor_health_t& m) { return m.trip_count == 1; });
  const MonoNs published = first->status_mono_ns;
  EXPECT_LT(published - tripped, kLiveCycle + 150 * kMillisecond) << "within one schedule round";
  RunFor(3 * kSecond);
  ASSERT_EQ(Trips().size(), 1U);
  EXPECT_LE(Trips()[0].mono_ns - published, 1'450 * kMillisecond);
  EXPECT_EQ(Trips()[0].valid_mask, 0x7F);
  EXPECT_EQ(Trips()[0].factor_bits, 0x20);
  EXPECT_GT(Trips()[0].not_before_utime, 0);
  EXPECT_LE(Trips()[0].not_before_utime, Trips()[0].not_after_utime);
}

TEST_F(MotorBusTest, AlternatingWithLiveDataTheLogTakesLonger) {
  Make(1, ", trip_fetch: alternate");
  Settle();
  Set("gm1", "trip", "excessive_shock");
  RunFor(5 * kSecond);
  ASSERT_EQ(Trips().size(), 1U);
  MonoNs published = 0;
  int meanwhile = 0;
  for (const motor_health_t& motor : Motor(1)) {
    if (motor.trip_count == 1 && published == 0) published = motor.status_mono_ns;
    if (published != 0 && motor.mono_ns < Trips()[0].mono_ns) ++meanwhile;
  }
  EXPECT_LE(Trips()[0].mono_ns - published, 2'600 * kMillisecond);
  EXPECT_GE(meanwhile, 2) << "live data continue";
}

// The unit shifts its logs when it trips: what was read of the first log before belongs to another trip.
TEST_F(MotorBusTest, ASecondTripMeanwhileNeverMixesSamples) {
  for (int delay_ms = 100; delay_ms < 1'700; delay_ms += 100) {
    SCOPED_TRACE(delay_ms);
    Make(1);
    Settle();
    Set("gm1", "load_w", "100");
    Set("gm1", "trip", "power_upper_a");
    RunFor(delay_ms * kMillisecond);
    // Another trip with other voltages all through its log.
    Set("gm1", "power", "cycle");
    Set("gm1", "voltage_v", "123.4");
    RunFor(20 * kMillisecond);
    Set("gm1", "trip", "excessive_shock");
    RunFor(20 * kSecond);
    // Whichever of the two was read first.
    EXPECT_THAT(Trips(), testing::UnorderedElementsAre(testing::Field(&trip_log_t::trip_count, 1),
                                                       testing::Field(&trip_log_t::trip_count, 2)));
    for (const trip_log_t& trip : Trips()) {
      const bool second = trip.trip_count == 2;
      EXPECT_EQ(trip.factor_bits, second ? 0x40 : 0x01);
      EXPECT_EQ(trip.samples[0][19] == 123.4F, second) << trip.samples[0][19];
    }
  }
}

TEST_F(MotorBusTest, AStopGoesOutInTheVeryNextSlot) {
  Make(1, ", motor_control: stop");
  Settle();
  Order(1, "fetch_trip_logs");
  RunFor(500 * kMillisecond);
  const std::int64_t writes = link_->writes();
  Order(2, "stop_motor");
  while (link_->writes() == writes) driver_->RunOnce();
  driver_->RunOnce();
  RunFor(kSecond);
  EXPECT_EQ(StatusOf(2).state, S::STATE_SUCCEEDED) << StatusOf(2).text;
  EXPECT_LT(StatusOf(2).finished_utime - StatusOf(2).started_utime, 400'000) << "no login came first";
  RunFor(20 * kSecond);
  EXPECT_EQ(StatusOf(1).state, S::STATE_SUCCEEDED) << StatusOf(1).text;
}

// ---- a stream of orders ----

class OrderStreamTest : public MotorBusTest, public testing::WithParamInterface<const char*> {};

// gm1 gets one order after the other, as fast as it takes them.
TEST_P(OrderStreamTest, StarvesNeitherTheOtherUnitNorItsOwn) {
  constexpr MonoNs kTime = 40 * kSecond;
  Make(2, ", motor_control: start_stop, log_out: true");
  Settle();
  std::uint32_t number = 0;
  for (const MonoNs end = clock_.Now() + kTime; clock_.Now() < end; driver_->RunOnce()) {
    const bool free = number == 0 || StatusOf(number).state >= S::STATE_SUCCEEDED;
    if (!free) continue;
    if (std::string(GetParam()) == "write_parameter") {
      const std::string value = ++number % 2 == 0 ? "2.0" : "3.0";
      Order(number, GetParam(), {{"name", "start_time_1"}, {"value", value}});
    } else {
      Order(++number, GetParam());
    }
  }
  EXPECT_GT(number, 10U);
  // At least every third slot is a live one, under stops without end every ninth; each unit has half of them, and a reading
  // takes two.
  const bool stops = std::string(GetParam()) == "stop_motor";
  const std::size_t minimum = static_cast<std::size_t>(kTime / kLiveCycle / 2 / (stops ? 10 : 3));
  EXPECT_GE(Motor(1).size(), minimum);
  EXPECT_GE(Motor(2).size(), minimum);
  for (const char* device : {"DEVICE/gm1", "DEVICE/gm2"}) {
    for (const auto& info : data_.All<device_info_t>(device)) {
      // Stops without end leave it one slot in nine: its readings are old then, but it has not failed.
      if (stops) {
        EXPECT_NE(info.state, device_info_t::STATE_OFFLINE) << device << ' ' << info.reason;
      } else {
        EXPECT_EQ(info.state, device_info_t::STATE_ONLINE) << device << ' ' << info.reason;
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Operations, OrderStreamTest,
                         testing::Values("read_parameters", "write_parameter", "stop_motor"),
                         [](const auto& each) { return std::string(each.param); });

TEST_F(MotorBusTest, AWholeBusIsBackSoonAfterItsPower) {
  Make(4);
  Settle();
  for (const MonoNs out : {2 * kSecond, 20 * kSecond, 200 * kSecond}) {
    SCOPED_TRACE(out / kSecond);
    for (const char* unit : {"gm1", "gm2", "gm3", "gm4"}) Set(unit, "power", "off");
    RunFor(out);
    for (const char* unit : {"gm1", "gm2", "gm3", "gm4"}) Set(unit, "power", "on");
    data_.Clear();
    RunFor(4'500 * kMillisecond);
    for (int unit = 1; unit <= 4; ++unit) EXPECT_FALSE(Motor(unit).empty()) << unit;
    RunFor(60 * kSecond);
  }
}

TEST_F(MotorBusTest, DeviceListsTheOperationsThatItsConfigurationPermits) {
  const auto operations = [&](const std::string& keys) {
    Make(1, keys);
    RunFor(2 * kSecond);
    return data_.All<device_info_t>("DEVICE/gm1").back().operations;
  };
  using testing::Contains;
  using testing::Not;
  const auto plain = operations("");
  EXPECT_THAT(plain, Contains("write_parameter"));
  EXPECT_THAT(plain, Contains("log_out"));
  EXPECT_THAT(plain, Not(Contains("stop_motor")));
  const auto stops = operations(", motor_control: stop");
  EXPECT_THAT(stops, Contains("stop_motor"));
  EXPECT_THAT(stops, Not(Contains("start_motor")));
  EXPECT_THAT(stops, Not(Contains("log_out")));
  EXPECT_THAT(operations(", motor_control: start_stop, log_out: true"),
              testing::IsSupersetOf({"start_motor", "log_out"}));
}

TEST_F(MotorBusTest, TheLimitsComeWhenTheyChangeAndOnceAMinute) {
  Make(1);
  RunFor(10 * kSecond);
  const auto limits = [&] { return data_.All<motor_limits_t>("LIMITS/gm1"); };
  ASSERT_FALSE(limits().empty());
  EXPECT_GT(limits().back().power_upper_w[0], 0);
  EXPECT_FLOAT_EQ(limits().back().overheat_c, limits().back().parameters[52]);
  RunFor(120 * kSecond);
  data_.Clear();
  RunFor(180 * kSecond);
  EXPECT_EQ(limits().size(), 3U);
  Order(1, "write_parameter", {{"name", "overheat_limit"}, {"value", "77.5"}});
  RunFor(5 * kSecond);
  ASSERT_EQ(StatusOf(1).state, S::STATE_SUCCEEDED) << StatusOf(1).text;
  EXPECT_FLOAT_EQ(limits().back().overheat_c, 77.5F);
}

}  // namespace
}  // namespace axlecast
