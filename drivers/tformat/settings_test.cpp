#include "drivers/tformat/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"

namespace axlecast {

const Family& tformat_family();

namespace tformat {
namespace {

struct Parsed {
  std::unique_ptr<TFormatSettings> settings;
  std::string errors;
};

Parsed Parse(const std::string& text) {
  ConfigErrors errors("t.yaml");
  ConfigMap map(YAML::Load(text), "axis1", errors);
  Parsed parsed{ParseSettings(map, {.baud = 2'500'000}), ""};
  map.Done();
  parsed.errors = errors.Text();
  return parsed;
}

TEST(Settings, KnowTheTs5669) {
  const Parsed parsed = Parse("{model: ts5669n127}");
  EXPECT_EQ(parsed.errors, "");
  const TFormatSettings& settings = *parsed.settings;
  EXPECT_EQ(settings.model, "ts5669n127");
  EXPECT_EQ(settings.counts_per_turn, 131'072);  // spec 5.4.1: 2^17
  EXPECT_EQ(settings.turns_range, 65'536);       // spec 5.4.2: 2^16
  EXPECT_EQ(settings.encoder_id, 0x11);          // spec 6.3.3
  EXPECT_EQ(settings.max_speed_rpm, 6'000);      // spec 4
  EXPECT_EQ(settings.max_accel_rad_s2, 80'000);  // spec 4
  EXPECT_TRUE(settings.ccw_increases);           // spec 5.4.1
  EXPECT_EQ(settings.wire_time, 51 * kMicrosecond);
  EXPECT_EQ(settings.latch_after, 5'500) << "the request of 4 us, and half of the 3 us to the reply";
  EXPECT_EQ(settings.noise_counts, 9);  // twice 4 LSB (spec 5.4.1), rounded up
  EXPECT_EQ(ZeroToleranceCounts(17), 127);
  EXPECT_GT(settings.timeout, 16 * kMillisecond);
  EXPECT_GE(settings.silence, 47 * kMicrosecond);
  EXPECT_TRUE(settings.eeprom_writable.none());
}

TEST(Settings, TakeEveryKey) {
  const Parsed parsed = Parse(
      "{model: custom, bits: 20, turn_bits: 12, enid: 0x22, battery: true, plan: id0, id3_every: 4,\n"
      " timeout_us: 5000, silence_us: 100, identity: {eeprom_address: 72, bytes: \"A1 05\"}, eeprom_writable: [72, "
      "73]}");
  EXPECT_EQ(parsed.errors, "");
  const TFormatSettings& settings = *parsed.settings;
  EXPECT_EQ(settings.counts_per_turn, 1'048'576);
  EXPECT_EQ(settings.turns_range, 4096);
  EXPECT_EQ(settings.encoder_id, 0x22);
  EXPECT_EQ(settings.wire_time, (51 + 3 * 31) * kMicrosecond / 4);
  EXPECT_EQ(settings.timeout, 5 * kMillisecond);
  EXPECT_EQ(settings.silence, 100 * kMicrosecond);
  EXPECT_EQ(settings.identity->bytes, (std::vector<std::uint8_t>{0xA1, 0x05}));
  EXPECT_TRUE(settings.eeprom_writable[73]);
  EXPECT_FALSE(settings.eeprom_writable[71]);
}

TEST(Settings, ANewerModelHas23Bits) {
  const Parsed parsed = Parse("{model: smart_abs_23}");
  EXPECT_EQ(parsed.errors, "");
  EXPECT_EQ(parsed.settings->counts_per_turn, 8'388'608);
  EXPECT_EQ(parsed.settings->encoder_id, 0x17);
}

TEST(Settings, NoTurnsWithoutBattery) {
  EXPECT_EQ(Parse("{model: ts5669n127, battery: false}").settings->turns_range, 0);
}

TEST(Settings, RefuseWhatIsWrongAndNameTheKey) {
  const std::pair<const char*, const char*> cases[] = {
      {"{}", "model"},
      {"{model: ts5668}", "ts5668"},
      {"{model: ts5669n127, bits: 23}", "bits"},
      {"{model: custom, bits: 23, turn_bits: 16}", "enid"},
      {"{model: custom, bits: 25, turn_bits: 16, enid: 1}", "25"},
      {"{model: custom, bits: 17, turn_bits: 16, enid: 256}", "256"},
      {"{model: ts5669n127, plan: id1}", "id1"},
      {"{model: ts5669n127, id3_every: 4}", "id3_every"},
      {"{model: ts5669n127, plan: id0, id3_every: 1}", "id3_every"},
      {"{model: ts5669n127, timeout_us: 10}", "timeout_us"},
      {"{model: ts5669n127, silence_us: 47}", "silence_us"},
      {"{model: ts5669n127, identity: {bytes: \"A1\"}}", "eeprom_address"},
      {"{model: ts5669n127, identity: {eeprom_address: 72}}", "bytes"},
      {"{model: ts5669n127, identity: {eeprom_address: 79, bytes: \"A1 05\"}}", "79"},
      {"{model: ts5669n127, identity: {eeprom_address: 80, bytes: \"A1\"}}", "80"},
      {"{model: ts5669n127, eeprom_writable: [80]}", "80"},
      {"{model: ts5669n127, batery: false}", "batery"},
  };
  for (const auto& [text, named] : cases) {
    const Parsed parsed = Parse(text);
    EXPECT_NE(parsed.errors.find(named), std::string::npos) << text << ": " << parsed.errors;
    EXPECT_NE(parsed.settings, nullptr);
  }
}

// Spec 6.1: 2.5 Mbps; 6.3: each field is a start bit, 8 data bits and the delimiter. Without addresses: one encoder.
TEST(TFormatFamily, TheLineIsThatOfTheSpec) {
  const Family& family = tformat_family();
  EXPECT_EQ(family.link, LinkKind::kSerial);
  EXPECT_EQ(family.default_line.baud, 2'500'000);
  EXPECT_EQ(family.default_line.parity, Parity::kNone);
  EXPECT_EQ(family.default_line.BitsPerCharacter(), 10);
  EXPECT_EQ(family.max_devices_per_bus, 1U);
}

TEST(CheckLine, RefusesOtherCharactersThan8N1) {
  BusConfig bus;
  bus.link.line = {.baud = 2'500'000, .parity = Parity::kEven, .stop_bits = 2};
  ConfigErrors errors("machine.yaml");
  ConfigMap map(YAML::Load("link: {parity: even, stop_bits: 2}"), "buses.b0", errors);
  CheckLine(map, bus);
  EXPECT_THAT(errors.Text(), testing::HasSubstr("buses.b0.link.parity: T-format has no parity bit"));
  EXPECT_THAT(errors.Text(), testing::HasSubstr("buses.b0.link.stop_bits: T-format has one stop bit"));
}

}  // namespace
}  // namespace tformat
}  // namespace axlecast
