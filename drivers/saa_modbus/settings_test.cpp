#include "drivers/saa_modbus/settings.h"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/saa/table_test_support.h"

namespace axlecast::saa_modbus {
namespace {

using testing::HasSubstr;

struct Parsed {
  std::unique_ptr<SaaModbusSettings> settings;
  std::string errors;
};

Parsed Parse(const std::string& text, std::int64_t baud = 19'200) {
  ConfigErrors errors("machine.yaml");
  ConfigMap map(YAML::Load(text), "buses.b0.devices.axis1", errors);
  BusConfig bus;
  bus.link.line.baud = baud;
  std::unique_ptr<DeviceSettings> settings = ParseSettings(map, bus);
  map.Done();
  return {std::unique_ptr<SaaModbusSettings>(dynamic_cast<SaaModbusSettings*>(settings.release())), errors.Text()};
}

// 4.1, 4.2, 5.1.7 (3).
TEST(SaaModbusSettings, KnowTheManualsDefaults) {
  const Parsed parsed = Parse("{bits: 16}");
  EXPECT_EQ(parsed.errors, "");
  const SaaModbusSettings& settings = *parsed.settings;
  EXPECT_EQ(settings.model, "saa");
  EXPECT_EQ(settings.address, 1);
  EXPECT_EQ(settings.counts_per_turn, 65'536);
  EXPECT_EQ(settings.turns_range, 0) << "single-turn";
  EXPECT_EQ(settings.max_speed_rpm, 5'000);
  EXPECT_EQ(settings.registers, 1);
  EXPECT_GT(settings.timeout, 16 * kMillisecond) << "the latency timer of an adapter that nobody has set up";
  EXPECT_EQ(settings.reply_timeout, settings.timeout);
  EXPECT_EQ(settings.write_interval, 10 * kSecond);
  // 8 + 7 characters of 10 bits and twice 3.5 of silence at 19,200 Bd.
  EXPECT_NEAR(static_cast<double>(settings.wire_time), 22.0 * 10 / 19'200 * 1e9, 10);
  EXPECT_NEAR(static_cast<double>(settings.latch_after), (8 + 3.5 / 2) * 10 / 19'200 * 1e9, 10);
}

// 5.1.7 (5) 1 and 2.
TEST(SaaModbusSettings, AskForTwoRegistersAbove16Bits) {
  EXPECT_EQ(Parse("{bits: 10}").settings->registers, 1);
  EXPECT_EQ(Parse("{bits: 17}").settings->registers, 2);
  EXPECT_EQ(Parse("{bits: 26}").settings->registers, 2);
  EXPECT_EQ(Parse("{bits: 26}").settings->counts_per_turn, 67'108'864);
  EXPECT_EQ(Parse("{bits: 14, registers: 2}").settings->registers, 2) << "02 is for certain protocols";
}

// 4.1, every column of the table: twice the accuracy, in counts.
TEST(SaaModbusSettings, TheNoiseIsTwiceTheAccuracyOfTheTable) {
  const auto noise = [](int bits) { return Parse("{bits: " + std::to_string(bits) + "}").settings->noise_counts; };
  for (const saa::TableColumn& column : saa::kTable41) EXPECT_EQ(noise(column.bits), column.noise) << column.bits;
  for (int bits = 10; bits < 16; ++bits) EXPECT_EQ(noise(bits), 1) << "the table gives none";
}

TEST(SaaModbusSettings, TakeEveryKey) {
  const Parsed parsed = Parse(
      "{model: saa90p50, bits: 20, registers: 2, address: 0xF7, timeout_us: 40000, "
      "write_interval_s: 60}");
  EXPECT_EQ(parsed.errors, "");
  EXPECT_EQ(parsed.settings->model, "saa90p50");
  EXPECT_EQ(parsed.settings->address, 247);
  EXPECT_EQ(parsed.settings->timeout, 40 * kMillisecond);
  EXPECT_EQ(parsed.settings->write_interval, 60 * kSecond);
}

TEST(SaaModbusSettings, RefuseWhatIsWrongAndSayWhatWouldBeRight) {
  const std::vector<std::array<std::string, 2>> cases = {
      {"{}", "axis1.bits: is missing: the encoder's resolution, 10 to 26 bits"},
      {"{bits: 9}", "axis1.bits: '9' is not within 10 to 26 bits"},
      {"{bits: 27}", "axis1.bits: '27' is not within 10 to 26 bits"},
      {"{bits: 17, registers: 1}", "axis1.registers: 1 holds up to 16 bits: 17 bits need 2"},
      {"{bits: 16, registers: 3}", "axis1.registers: '3'"},
      {"{bits: 16, address: 0}", "axis1.address: '0' is not within 1 to 247"},
      {"{bits: 16, address: 248}", "axis1.address: '248' is not within 1 to 247"},
      {"{bits: 16, timeout_us: 1000}", "longer than one exchange at this baud rate"},
      {"{bits: 16, write_interval_s: 0}", "axis1.write_interval_s: '0' is not within 1 to 86400 s"},
      {"{model: saa100, bits: 16}", "axis1.model: 'saa100'"},
      {"{bits: 16, adress: 2}", "did you mean 'address'"},
  };
  for (const auto& [text, said] : cases) {
    const Parsed parsed = Parse(text);
    EXPECT_THAT(parsed.errors, HasSubstr(said)) << text;
    EXPECT_THAT(parsed.errors, HasSubstr("machine.yaml:1:")) << text;
    EXPECT_NE(parsed.settings, nullptr);
  }
}

// 5.1.7: at least 3.5 characters; 1.75 ms above 19,200 Bd (Modbus over Serial Line V1.02, 2.5.1.1).
TEST(SaaModbusSettings, SilentIntervalOfEachRate) {
  for (const auto& [baud, us] :
       {std::pair{2'400, 14'583.3}, {4'800, 7'291.7}, {9'600, 3'645.8}, {19'200, 1'822.9}, {57'600, 1'750.0}}) {
    EXPECT_NEAR(static_cast<double>(SilentInterval({.baud = baud})) / 1e3, us, 0.1) << baud;
    EXPECT_GE(Parse("{bits: 20}", baud).settings->timeout, LongestExchange({.baud = baud}));
  }
}

std::string CheckedBus(std::int64_t baud) {
  ConfigErrors errors("machine.yaml");
  ConfigMap map(YAML::Load("link: {baud: " + std::to_string(baud) + "}"), "buses.b0", errors);
  BusConfig bus;
  bus.link.line.baud = baud;
  EXPECT_NE(ParseBus(map, bus), nullptr);
  return errors.Text();
}

TEST(SaaModbusBus, TakesTheManualsRatesOnly) {
  for (const int baud : {2'400, 4'800, 9'600, 19'200, 57'600}) EXPECT_EQ(CheckedBus(baud), "") << baud;
  for (const int baud : {1'200, 38'400, 115'200}) {
    EXPECT_THAT(CheckedBus(baud), HasSubstr("buses.b0.link.baud: " + std::to_string(baud) + " is no rate"));
    EXPECT_THAT(CheckedBus(baud), HasSubstr("2400, 4800, 9600, 19200 (as delivered) or 57600"));
  }
}

TEST(SaaModbusBus, KeepsTheSilentIntervalBetweenFrames) {
  ConfigErrors errors("machine.yaml");
  ConfigMap map(YAML::Load("{}"), "buses.b0", errors);
  BusConfig bus;
  bus.link.line.baud = 9'600;
  const auto family_bus = ParseBus(map, bus);
  EXPECT_EQ(family_bus->pacing.after_reply, SilentInterval(bus.link.line));
  EXPECT_EQ(family_bus->pacing.after_request, SilentInterval(bus.link.line));
}

TEST(SaaModbusBus, EveryAddressStandsOnce) {
  ConfigErrors errors("machine.yaml");
  ConfigMap map(YAML::Load("devices:\n  a: {bits: 16}\n  b: {bits: 16}\n"), "buses.b0", errors);
  BusConfig bus;
  bus.link.line.baud = 19'200;
  for (auto& [name, keys] : map.Maps("devices")) {
    DeviceConfig device;
    device.name = name;
    device.settings = ParseSettings(keys, bus);
    bus.devices.push_back(device);
  }
  CheckBus(map, bus);
  EXPECT_THAT(errors.Text(), HasSubstr("machine.yaml:3:"));
  EXPECT_THAT(errors.Text(), HasSubstr("address 1 is that of a too"));
  EXPECT_THAT(errors.Text(), HasSubstr("set_address"));
}

}  // namespace
}  // namespace axlecast::saa_modbus
