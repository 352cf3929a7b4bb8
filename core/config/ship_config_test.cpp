#include "core/config/ship_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/hosts.h"
#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

// The keys of ship begin in line 3.
std::optional<MachineConfig> Parse(const std::string& ship, ConfigErrors& errors, const std::string& rest = "") {
  return ParseConfig("machine: press3\nship:" + ship + "\nrecorder: {logs: {all: {}}}\n" + rest +
                         "buses:\n  b0: {family: point, simulate: true, devices: {axis1: {}}}\n",
                     errors);
}

ShipConfig Ship(const std::string& keys) {
  ConfigErrors errors("m.yaml");
  const auto machine = Parse(keys, errors);
  EXPECT_EQ(errors.Text(), "");
  return machine ? machine->ship : ShipConfig{};
}

std::string Mistake(const std::string& keys) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(Parse(keys, errors));
  return errors.Text();
}

TEST(LoadShip, ReadsEveryKey) {
  const ShipConfig ship = Ship(
      "\n  database: \"host=db1,db2 dbname=axlecast user=axlecast_press\"\n"
      "  password: {file: /etc/axlecast/ship.password}\n"
      "  order: oldest_first\n"
      "  bandwidth: 10MB\n"
      "  reserve: 20GB\n"
      "  metrics: 192.0.2.7:8381\n"
      "  detail:\n"
      "    - {channels: '^POSITION/spare', detail: deadband, deadband: 0.5, longest: 1m}\n"
      "    - {channels: '^POSITION/', detail: full, raw: true}");
  EXPECT_EQ(ship.database, "host=db1,db2 dbname=axlecast user=axlecast_press");
  EXPECT_EQ(ship.password.file, "/etc/axlecast/ship.password");
  EXPECT_FALSE(ship.newest_first);
  EXPECT_EQ(ship.bandwidth, 10 << 20);
  EXPECT_EQ(ship.reserve_bytes, std::int64_t{20} << 30);
  EXPECT_EQ(ship.reserve_percent, 0);
  EXPECT_EQ(ship.metrics, "192.0.2.7:8381");
  ASSERT_EQ(ship.rules.size(), 2U);
  EXPECT_EQ(ship.rules[0].channels, "^POSITION/spare");
  EXPECT_EQ(ship.rules[0].detail, ShipLevel::kDeadband);
  EXPECT_EQ(ship.rules[0].deadband, 0.5);
  EXPECT_EQ(ship.rules[0].longest, 60 * kSecond);
  EXPECT_EQ(ship.rules[1].detail, ShipLevel::kFull);
  EXPECT_TRUE(ship.rules[1].raw);
}

TEST(LoadShip, ADatabaseIsEnough) {
  const ShipConfig ship = Ship(" {database: 'host=db1'}");
  EXPECT_TRUE(ship.password.empty());
  EXPECT_TRUE(ship.newest_first);
  EXPECT_EQ(ship.bandwidth, 0);
  EXPECT_EQ(ship.reserve_percent, 5);
  EXPECT_EQ(ship.metrics, "");
  EXPECT_EQ(Ship(" {database: 'host=db1', metrics: 8381}").metrics, "8381");
  EXPECT_EQ(Ship(" {database: 'host=db1', reserve: 12.5%}").reserve_percent, 12.5);
}

TEST(LoadShip, NamesMistakes) {
  EXPECT_THAT(Mistake(" {order: newest_first}"), HasSubstr("ship.database: is missing or empty"));
  EXPECT_THAT(Mistake(" {database: a, order: random}"), HasSubstr("newest_first"));
  EXPECT_THAT(Mistake(" {database: a, reserve: 5}"), HasSubstr("5%, 20GB"));
  EXPECT_THAT(Mistake(" {database: a, reserve: 99%}"), HasSubstr("at most 90%"));
  EXPECT_THAT(Mistake(" {database: a, bandwidth: 1kB}"), HasSubstr("at least 10kB"));
  EXPECT_THAT(Mistake(" {database: a, metrics: 0}"), HasSubstr("ship.metrics: '0' has no port"));
  EXPECT_THAT(Mistake(" {database: a, metrics: 'press3:8381'}"), HasSubstr("begin with an address of this host"));
  EXPECT_THAT(Mistake(" {database: a, detail: [{channels: 'a('}]}"), HasSubstr("channels"));
  EXPECT_THAT(Mistake(" {database: a, detail: [{channels: a, detail: deadband}]}"),
              HasSubstr("deadband beside it"));
  EXPECT_THAT(Mistake(" {database: a, detail: [{channels: a, deadband: 1}]}"), HasSubstr("`detail: deadband`"));
  EXPECT_THAT(Mistake(" {database: a, detail: [{channels: a, longest: 0.5s}]}"), HasSubstr("is 1s to 1d"));
  EXPECT_THAT(Mistake(" {database: a, detial: []}"), HasSubstr("detail"));
}

TEST(LoadShip, RefusesAPasswordInTheFileWithoutRepeatingIt) {
  for (const char* database : {"host=a password=hunter2", "postgresql://u:hunter2@db/x",
                               "host=a PASSWORD = 'hunter2'", "postgresql://db/x?user=u&password=hunter2"}) {
    const std::string text = Mistake(std::string(" {database: \"") + database + "\"}");
    EXPECT_THAT(text, HasSubstr("contains a password")) << database;
    EXPECT_EQ(text.find("hunter2"), std::string::npos) << text;
  }
  EXPECT_FALSE(HasPassword("host=db1 passfile=/etc/pgpass user=a"));
  EXPECT_FALSE(HasPassword("postgresql://writer@db1:5432,db2/axlecast?connect_timeout=2"));
  EXPECT_THAT(Mistake(" {database: a, password: hunter2}"), HasSubstr("names no place"));
}

TEST(LoadShip, NeedsARecorder) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(
      ParseConfig("machine: press3\nship: {database: a}\nbuses:\n  b0: {family: point, simulate: true, "
                  "devices: {axis1: {}}}\n",
                  errors));
  EXPECT_THAT(errors.Text(), HasSubstr("at least one log below `recorder`"));
}

TEST(LoadShip, RunsOnOneHostThatRecords) {
  const auto text = [](const std::string& hosts) {
    ConfigErrors errors("m.yaml");
    const auto machine = Parse(" {database: a}", errors,
                               "lcm: {url: 'udpm://239.255.76.67:7667?ttl=1', command_url: "
                               "'udpm://239.255.76.67:7668?ttl=1'}\n" +
                                   hosts);
    if (!machine) return errors.Text();
    return PartOn(*machine, "plc2").value().ship.database;
  };
  EXPECT_THAT(text("hosts: {plc1: {buses: [b0], bridge: true, recorder: true}}\n"), HasSubstr("exactly one host"));
  EXPECT_THAT(text("hosts: {plc1: {buses: [b0], bridge: true, recorder: true}, plc2: {ship: true}}\n"),
              HasSubstr("'plc2' has `ship: true` without `recorder: true`"));
  EXPECT_EQ(text("hosts: {plc1: {buses: [b0], bridge: true, recorder: true, ship: true}, plc2: {}}\n"), "");
  EXPECT_EQ(text("hosts: {plc1: {buses: [b0], bridge: true}, plc2: {recorder: true, ship: true}}\n"), "a");
}

}  // namespace
}  // namespace axlecast
