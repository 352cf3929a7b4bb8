#include "drivers/cia406/settings.h"

#include <gmock/gmock.h>

#include "drivers/cia406/bench_test_support.h"

namespace axlecast::cia406 {
namespace {

using ::testing::HasSubstr;

BusConfig Bus(double poll_hz = 0) { return BusOf({}, poll_hz); }

// Returns the errors in these keys; empty if there are no errors.
std::string ProblemOf(const std::string& keys, double poll_hz = 0) {
  ConfigErrors errors("test.yaml");
  static_cast<void>(SettingsFrom(keys, Bus(poll_hz), errors));
  return errors.Text();
}
Cia406Settings Parsed(const std::string& keys, double poll_hz = 0) {
  ConfigErrors errors("test.yaml");
  const auto settings = SettingsFrom(keys, Bus(poll_hz), errors);
  EXPECT_TRUE(errors.empty()) << errors.Text();
  return static_cast<const Cia406Settings&>(*settings);
}
std::string BusProblem(const std::vector<std::string>& devices) {
  const BusConfig bus = BusOf(devices, 100);
  ConfigErrors errors("test.yaml");
  ConfigMap map(YAML::Load("{devices: {a: {}, b: {}, c: {}}}"), "", errors);
  CheckBus(map, bus);
  return errors.Text();
}

TEST(Cia406Settings, TheDefaultsAreTheStandards) {
  const Cia406Settings settings = Parsed("node: 5, bits: 13, turn_bits: 12");
  EXPECT_EQ(settings.model, "cia406");
  EXPECT_EQ(settings.cob_id, 0x185U) << "pre-defined connection set, CiA 301 7.3.3";
  EXPECT_FALSE(settings.ccw_increases) << "6000h bit 0 is 0: clockwise";
  EXPECT_EQ(settings.counts_per_turn, 8192);
  EXPECT_EQ(settings.turns_range, 4096);
  EXPECT_EQ(settings.mode, Mode::kCyclic);
  EXPECT_EQ(settings.own_period, 100 * kMillisecond);
  EXPECT_TRUE(settings.nmt_start);
  EXPECT_EQ(settings.heartbeat, 0);
}

// ISO 11898-1 10.4 at 250 kbit/s, 4 us a bit: frames of 0, 4 and 8 bytes have 44, 76 and 108 bits, 3 between frames and at
// most 8, 16 and 24 stuff bits. TPDO1; SYNC and TPDO1; an SDO request and its answer.
TEST(Cia406Settings, TimesOnTheWire) {
  EXPECT_EQ(Parsed("node: 5, bits: 13").wire_time, 4 * 95 * kMicrosecond);
  EXPECT_EQ(Parsed("node: 5, bits: 13, transmission: sync", 100).wire_time, 4 * (55 + 95) * kMicrosecond);
  EXPECT_EQ(Parsed("node: 5, bits: 13, mode: sdo", 100).wire_time, 4 * 2 * 135 * kMicrosecond);
  EXPECT_EQ(Parsed("node: 5, bits: 13, transmission: sync", 100).latch_after, 4 * 55 * kMicrosecond) << "SYNC";
  EXPECT_EQ(Parsed("node: 5, bits: 13, mode: sdo", 100).latch_after, 4 * 135 * kMicrosecond) << "the request";
}

TEST(Cia406Settings, ASingleTurnEncoderHasNoTurns) { EXPECT_EQ(Parsed("node: 1, bits: 16").turns_range, 0); }

TEST(Cia406Settings, OnlyItsOwnFramesPassTheFilters) {
  const Cia406Settings settings = Parsed("node: 5, bits: 13, cob_id: 0x2a0");
  const auto hears = [&](std::uint32_t id) {
    return std::any_of(settings.can_filters.begin(), settings.can_filters.end(),
                       [id](const CanFilter& filter) { return Passes(filter, id); });
  };
  for (const std::uint32_t id : {0x080U, 0x085U, 0x2A0U, 0x585U, 0x705U}) EXPECT_TRUE(hears(id)) << id;
  for (const std::uint32_t id :
       {0x000U, 0x185U, 0x605U, 0x586U, 0x706U, 0x585U | kCanExtended, 0x2A0U | kCanRemote}) {
    EXPECT_FALSE(hears(id)) << id;
  }
}

TEST(Cia406Settings, MistakesAreNamed) {
  EXPECT_THAT(ProblemOf("bits: 13"), HasSubstr("node: is missing"));
  EXPECT_THAT(ProblemOf("node: 5"), HasSubstr("bits: is missing"));
  EXPECT_THAT(ProblemOf("node: 128, bits: 13"), HasSubstr("1 to 127"));
  EXPECT_THAT(ProblemOf("node: 0, bits: 13"), HasSubstr("1 to 127"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 20, turn_bits: 13"),
              HasSubstr("at most 12: the position value 6004h has 32"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, cob_id: 0x180"), HasSubstr("0x181 to 0x57F"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, transmission: sync"), HasSubstr("sync needs poll_hz"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, transmission: sync, period_ms: 10", 100), HasSubstr("leave it out"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, mode: sdo, transmission: sync", 100),
              HasSubstr("is of mode tpdo only"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, mode: sdo, cob_id: 0x190"), HasSubstr("is of mode tpdo only"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, identity: {colour: 3}"), HasSubstr("colour"));
  EXPECT_THAT(ProblemOf("node: 5, bits: 13, heartbeat: 3"), HasSubstr("heartbeat_ms"));
}

TEST(Cia406Settings, EachNodeNeedsItsOwnIdAndCobId) {
  EXPECT_THAT(BusProblem({"node: 5, bits: 13", "node: 5, bits: 13"}), HasSubstr("node 5 is that of a too"));
  EXPECT_THAT(BusProblem({"node: 5, bits: 13", "node: 6, bits: 13, cob_id: 0x185"}),
              HasSubstr("cob_id 0x185 is that of a too"));
  EXPECT_EQ(BusProblem({"node: 5, bits: 13", "node: 6, bits: 13", "node: 7, bits: 13, mode: sdo"}), "");
}

TEST(Cia406Settings, OneOfSeveralSendsSync) {
  const BusConfig bus = BusOf(
      {"node: 5, bits: 13", "node: 6, bits: 13, transmission: sync", "node: 7, bits: 13, transmission: sync"}, 100);
  EXPECT_FALSE(ProducesSync(bus, bus.devices[0]));
  EXPECT_TRUE(ProducesSync(bus, bus.devices[1]));
  EXPECT_FALSE(ProducesSync(bus, bus.devices[2]));
}

TEST(Cia406Settings, TheIdentifiersThatItUses) {
  const BusConfig bus = BusOf({"node: 5, bits: 13"}, 0);
  for (const std::uint32_t id : {0x000U, 0x080U, 0x085U, 0x185U, 0x585U, 0x605U, 0x705U}) {
    EXPECT_TRUE(UsesId(bus.devices[0], id)) << id;
  }
  EXPECT_FALSE(UsesId(bus.devices[0], 0x205));
}

TEST(Cia406Settings, APresetMayMissBy) {
  EXPECT_EQ(PresetToleranceCounts(8), 2);
  EXPECT_EQ(PresetToleranceCounts(13), 5) << "0.2 degrees of 8192";
}

}  // namespace
}  // namespace axlecast::cia406
