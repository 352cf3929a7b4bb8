#include "drivers/cia406/node_facts.h"

#include <gmock/gmock.h>

#include <map>

#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using ::testing::HasSubstr;

struct ObjectLess {
  bool operator()(ObjectId a, ObjectId b) const { return a.index != b.index ? a.index < b.index : a.sub < b.sub; }
};
using Objects = std::map<ObjectId, std::uint32_t, ObjectLess>;

// A 13 + 12 bit multi-turn encoder, node 5: all that it is asked for.
Objects Encoder() {
  return {{kDeviceType, 0x0002'0196}, {kVendor, 0x2DC},         {kProduct, 0x58},
          {kRevision, 0x0001'0002},   {kSerial, 4711},          {kOperatingStatus, 0x4},
          {kUnitsPerTurn, 1 << 13},   {kTotalRange, 1 << 25},   {kPhysicalSteps, 1 << 16},
          {kPhysicalTurns, 4096},     {kTpdoCobId, 0x185},      {kTpdoType, 254},
          {kTpdoTimer, 100},          {kTpdoFirst, 0x6004'0020}};
}

Cia406Settings Settings() {
  Cia406Settings settings;
  settings.node = 5;
  settings.bits = 13;
  settings.turn_bits = 12;
  settings.ccw_increases = false;
  settings.cob_id = 0x185;
  return settings;
}

NodeFacts FactsOf(const Objects& objects, Mode mode = Mode::kCyclic) {
  NodeFacts facts(mode);
  while (const auto wanted = facts.Missing()) {
    const auto found = objects.find(*wanted);
    SdoResult result{.kind = SdoResult::Kind::kAborted, .request = {.object = *wanted}, .value = 0x0602'0000};
    if (found != objects.end()) {
      result.kind = SdoResult::Kind::kValue;
      result.value = found->second;
    }
    facts.On(result);
  }
  return facts;
}

std::string MismatchOf(const Objects& changed, Cia406Settings settings = Settings()) {
  Objects objects = Encoder();
  for (const auto& [object, value] : changed) objects[object] = value;
  return ErrorText(CheckFacts(FactsOf(objects, settings.mode), settings));
}
std::string MismatchWithout(ObjectId object) {
  Objects objects = Encoder();
  objects.erase(object);
  return ErrorText(CheckFacts(FactsOf(objects), Settings()));
}

TEST(Cia406Facts, TheConfiguredEncoderIsAccepted) { EXPECT_EQ(MismatchOf({}), ""); }

TEST(Cia406Facts, WhatIsNotOfferedIsNoMismatch) {
  const Objects encoder = Encoder();
  for (const auto& [object, value] : encoder) {
    if (object == kDeviceType) continue;
    EXPECT_EQ(MismatchWithout(object), "") << object.index;
  }
}

TEST(Cia406Facts, ANodeMustBeAnEncoder) {
  EXPECT_THAT(MismatchOf({{kDeviceType, 0x000F'0191}}),
              HasSubstr("device type 0x000F0191 (1000h) is of profile 401"));
  EXPECT_THAT(MismatchWithout(kDeviceType), HasSubstr("1000h cannot be read"));
  EXPECT_EQ(MismatchOf({{kDeviceType, 0x0001'0196}}), "") << "BEI MHK5 p. 27: single-turn";
}

TEST(Cia406Facts, ResolutionAndRangeMustBeTheFiles) {
  EXPECT_THAT(MismatchOf({{kUnitsPerTurn, 4096}}), HasSubstr("6001h is 4096 steps a turn, bits: 13 means 8192"));
  EXPECT_THAT(MismatchOf({{kTotalRange, 1 << 24}}),
              HasSubstr("6002h is 16777216, bits: 13 with turn_bits: 12 means 2^25"));
  Cia406Settings wide = Settings();
  wide.bits = 16;
  wide.turn_bits = 16;
  for (const std::uint32_t whole : {0U, 0xFFFF'FFFFU}) {
    EXPECT_EQ(MismatchOf({{kUnitsPerTurn, 1 << 16}, {kTotalRange, whole}}, wide), "") << "2^32 has 33 bits";
  }
}

TEST(Cia406Facts, WithoutScalingThePhysicalResolutionCounts) {
  EXPECT_THAT(MismatchOf({{kOperatingStatus, 0}}), HasSubstr("scaling is off, and 6501h is 65536 steps a turn"));
  EXPECT_EQ(MismatchOf({{kOperatingStatus, 0}, {kPhysicalSteps, 1 << 13}}), "");
  EXPECT_THAT(MismatchOf({{kOperatingStatus, 0}, {kPhysicalSteps, 1 << 13}, {kPhysicalTurns, 256}}),
              HasSubstr("6502h is 256 turns, turn_bits: 12 means 4096"));
}

TEST(Cia406Facts, TheSenseOfCountingMustBeTheFiles) {
  EXPECT_THAT(MismatchOf({{kOperatingStatus, 0x5}}), HasSubstr("counts up ccw, the file has counting: cw"));
}

TEST(Cia406Facts, TheIdentityMustBeTheFilesWhereItNamesOne) {
  Cia406Settings settings = Settings();
  settings.identity = {0x2DC, 0x58, 0x0001'0002, 4711};
  EXPECT_EQ(MismatchOf({}, settings), "");
  EXPECT_THAT(MismatchOf({{kVendor, 1}}, settings), HasSubstr("vendor (1018h sub 1) is 0x1, the file has 0x2DC"));
  EXPECT_THAT(MismatchOf({{kProduct, 1}}, settings), HasSubstr("product (1018h sub 2)"));
  EXPECT_THAT(MismatchOf({{kRevision, 1}}, settings), HasSubstr("revision (1018h sub 3)"));
  EXPECT_THAT(MismatchOf({{kSerial, 1}}, settings), HasSubstr("serial (1018h sub 4)"));
}

TEST(Cia406Facts, Tpdo1MustCarryThePosition) {
  EXPECT_THAT(MismatchOf({{kTpdoCobId, 0x8000'0185}}), HasSubstr("TPDO1 is switched off"));
  EXPECT_THAT(MismatchOf({{kTpdoCobId, 0x285}}), HasSubstr("COB-ID 0x285 (1800h sub 1), the file expects 0x185"));
  EXPECT_EQ(MismatchOf({{kTpdoCobId, 0x4000'0185}}), "") << "bit 30 forbids RTR";
  EXPECT_THAT(MismatchOf({{kTpdoFirst, 0x6030'0110}}), HasSubstr("TPDO1 begins with 0x60300110"));
  Cia406Settings sync = Settings();
  sync.mode = Mode::kSync;
  EXPECT_THAT(MismatchOf({}, sync), HasSubstr("transmission type 254"));
  EXPECT_EQ(MismatchOf({{kTpdoType, 1}}, sync), "");
  Cia406Settings polled = Settings();
  polled.mode = Mode::kPolled;
  EXPECT_EQ(MismatchOf({{kTpdoCobId, 0x8000'0185}}, polled), "") << "TPDO1 does not matter";
}

TEST(Cia406Facts, ASynchronousTpdo) {
  const auto synchronous = [](std::uint32_t type) {
    Objects objects = Encoder();
    objects[kTpdoType] = type;
    return FactsOf(objects).synchronous();
  };
  EXPECT_FALSE(synchronous(0)) << "acyclic";
  EXPECT_TRUE(synchronous(1));
  EXPECT_TRUE(synchronous(240));
  EXPECT_FALSE(synchronous(254));
  EXPECT_FALSE(synchronous(255));
}

TEST(Cia406Facts, ATimeOutTellsNothing) {
  NodeFacts facts(Mode::kCyclic);
  facts.On({.kind = SdoResult::Kind::kTimedOut, .request = {.object = kDeviceType}});
  EXPECT_EQ(facts.Missing(), kDeviceType);
  facts.On({.kind = SdoResult::Kind::kSegmented, .request = {.object = kDeviceType}});
  EXPECT_EQ(facts.Missing(), kVendor);
  EXPECT_EQ(facts.Get(kDeviceType), std::nullopt);
}

}  // namespace
}  // namespace axlecast::cia406
