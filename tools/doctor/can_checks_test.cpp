#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using State = CanController::State;

MachineConfig Turret() {
  return MachineOf(
      "buses:\n  c0:\n    family: saa_can\n    link: {iface: can0, bitrate: 250000}\n    devices: {turret: {bits: "
      "14, "
      "node: 32, unit: deg}}\n");
}

CanInterface Sound() {
  CanInterface interface;
  interface.is_can = interface.up = interface.is_controller = interface.restarts = true;
  interface.state = State::kActive;
  interface.tec = interface.rec = 0;
  interface.bitrate = 250'000;
  interface.restart_ms = 100;
  return interface;
}

constexpr auto kChecks = {"can_missing", "can_down",  "can_bitrate", "can_mode",
                          "can_restart", "can_state", "can_queue"};

Symptoms AllOfThem(const CanInterfaceReply& reply, std::int64_t queue = 10) {
  HostFacts host;
  host.can.emplace("can0", reply);
  host.can_queues["can0"] = queue;
  Symptoms all;
  for (const char* const check : kChecks) {
    for (Symptom& symptom : RunCheck(check, Turret(), host)) all.push_back(std::move(symptom));
  }
  return all;
}

TEST(CanChecks, ASoundInterfaceIsToldNothingOf) { EXPECT_THAT(AllOfThem(Sound()), IsEmpty()); }

struct CanCase {
  void (*spoil)(CanInterface&);
  const char* found;
  const char* line;  // the last one
};

TEST(CanChecks, EachTroubleIsToldOnceWithItsLine) {
  const CanCase cases[] = {
      {[](CanInterface& one) { one.is_can = false; }, "is not a CAN interface", "ip -brief link show type can"},
      {[](CanInterface& one) { one.up = false; }, "is down",
       "ip link set can0 up type can bitrate 250000 restart-ms 100"},
      {[](CanInterface& one) { one.up = one.is_controller = one.restarts = false; }, "is down",
       "ip link set can0 up"},
      {[](CanInterface& one) { one.bitrate = 500'000; }, "500000 bit/s, the machine file has 250000",
       "bitrate 250000"},
      {[](CanInterface& one) { one.listen_only = true; }, "listen-only", "listen-only off"},
      {[](CanInterface& one) { one.loopback = true; }, "loopback", "loopback off"},
      {[](CanInterface& one) { one.presume_ack = true; }, "presume-ack", "presume-ack off"},
      {[](CanInterface& one) { one.restart_ms = 0; }, "stays off", "restart-ms 100"},
      {[](CanInterface& one) { one.state = State::kPassive; }, "error-passive", "terminating resistors"},
      {[](CanInterface& one) { one.state = State::kBusOff; }, "bus-off",
       "ip link set can0 down; ip link set can0 up"},
      {[](CanInterface& one) { one.rec = 96; }, "receive errors 96", "cable"},
  };
  for (const CanCase& one : cases) {
    CanInterface interface = Sound();
    one.spoil(interface);
    const Symptoms symptoms = AllOfThem(interface);
    ASSERT_EQ(symptoms.size(), 1U) << one.found;
    EXPECT_THAT(symptoms[0].found, HasSubstr(one.found));
    EXPECT_THAT(LineOf(symptoms[0].fixes.back()), HasSubstr(one.line));
    EXPECT_FALSE(symptoms[0].safe) << "an interface of a running bus is the operator's";
  }
}

TEST(CanChecks, WhatIsFineIsLeftAlone) {
  CanInterface near = Sound();
  near.bitrate = 252'500;  // 1 %
  EXPECT_THAT(AllOfThem(near), IsEmpty());
  CanInterface slcan = Sound();
  slcan.restarts = false;  // cannot
  slcan.restart_ms = 0;
  EXPECT_THAT(AllOfThem(slcan), IsEmpty());
}

TEST(CanChecks, AMissingInterfaceIsNotAskedFurther) {
  const Symptoms symptoms = AllOfThem(tl::unexpected(ENODEV));
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("can0 does not exist"));
}

TEST(CanChecks, AQueueHoldsTwoOrdersForEachNode) {
  EXPECT_THAT(AllOfThem(Sound(), 2), IsEmpty());
  const Symptoms symptoms = AllOfThem(Sound(), 1);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_EQ(LineOf(symptoms[0].fixes[0]), "ip link set can0 txqueuelen 100");
}

}  // namespace
}  // namespace axlecast
