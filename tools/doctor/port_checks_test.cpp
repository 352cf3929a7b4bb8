#include "tools/doctor/checks.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/doctor_test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

PortFacts& PortOf(HostFacts& host) { return host.ports["/dev/ttyUSB0"]; }

TEST(PortChecks, AGoodPortIsToldNothingOf) {
  const HostFacts host = GoodHost();
  for (auto* const check : {&CheckPortMissing, &CheckPortPermission, &CheckPortHeld, &CheckPortName,
                            &CheckPortProber, &CheckUsbLatency, &CheckAdapterRate, &CheckSpiBuffer}) {
    EXPECT_THAT(check(OneAxis(), host), IsEmpty());
  }
}

TEST(PortChecks, WhatCannotBeLookedAtSaysWhy) {
  HostFacts host = GoodHost();
  PortOf(host).file = Unseen("/dev/ttyUSB0", EACCES);
  EXPECT_THAT(CheckPortMissing(OneAxis(), host).at(0).found, HasSubstr("Permission denied"));
  EXPECT_THAT(CheckPortPermission(OneAxis(), host), IsEmpty()) << "one symptom is enough";
}

struct PermissionCase {
  uid_t user;
  mode_t mode;
  gid_t group;
  bool usable;  // by access(2) for this user
  bool found;
};

TEST(PortChecks, PermissionsAreTheUsersAndForRootThoseOfAService) {
  const PermissionCase cases[] = {
      {1000, 0660, 20, true, false}, {1000, 0660, 20, false, true}, {0, 0660, 20, true, false},
      {0, 0660, 0, true, true},      {0, 0600, 20, true, true},     {0, 0640, 20, true, true},
      {0, 0666, 0, true, false},
  };
  for (const PermissionCase& one : cases) {
    HostFacts host = GoodHost();
    host.user = one.user;
    HostFile& file = PortOf(host).file;
    file.mode = one.mode;
    file.gid = one.group;
    file.readable = file.writable = one.usable;
    EXPECT_EQ(!CheckPortPermission(OneAxis(), host).empty(), one.found)
        << one.user << ' ' << std::oct << one.mode << ' ' << one.group;
  }
}

TEST(PortChecks, OnlyTheBusOwnDriverMayHoldAPort) {
  HostFacts host = GoodHost();
  PortOf(host).holders = {
      {7, "axlecast-tforma", {"/usr/bin/axlecast-tformat", "--config", "m.yaml", "--bus", "b0"}}};
  EXPECT_THAT(CheckPortHeld(OneAxis(), host), IsEmpty());
  PortOf(host).holders[0].words.back() = "b1";
  EXPECT_EQ(CheckPortHeld(OneAxis(), host).size(), 1U);
  PortOf(host).holders = {{8, "minicom", {"minicom", "--bus", "b0"}}, {9, "axlecast-x", {}}};
  const Symptoms symptoms = CheckPortHeld(OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 2U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("process 8 (minicom)"));
}

TEST(PortChecks, ALatencyTimerOfOneMillisecondIsRight) {
  HostFacts host = GoodHost();
  PortOf(host).latency_timer = "/sys/x/latency_timer";
  for (const std::int64_t ms : {0, 1}) {
    PortOf(host).latency_ms = ms;
    EXPECT_THAT(CheckUsbLatency(OneAxis(), host), IsEmpty()) << ms;
  }
  PortOf(host).latency_ms = 16;
  const Symptom symptom = CheckUsbLatency(OneAxis(), host).at(0);
  EXPECT_THAT(symptom.found, HasSubstr("about 62 exchanges per second"));
  EXPECT_EQ(LineOf(symptom.fixes[0]), "echo 1 > /sys/x/latency_timer");
}

TEST(PortChecks, AnAdapterThatFitsIsNoFinding) {
  HostFacts host = GoodHost();
  PortOf(host).usb = {.vendor = 0x0403, .product = 0x6014, .release = 0x0900};  // FT232H: 2.526 of 2.5 Mbaud
  EXPECT_THAT(CheckAdapterRate(OneAxis(), host), IsEmpty());
  PortOf(host).usb->vendor = 0x1234;  // not known
  EXPECT_THAT(CheckAdapterRate(OneAxis(), host), IsEmpty());
  PortOf(host).usb = {.vendor = 0x0403, .product = 0x6001, .release = 0x0600};  // FT232R
  EXPECT_THAT(CheckAdapterRate(OneAxis(), host).at(0).found, HasSubstr("FT232R"));
}

TEST(PortChecks, ASimulatedBusNeedsNoPort) {
  HostFacts host = GoodHost();
  PortOf(host).file = Unseen("/dev/ttyUSB0", ENOENT);
  EXPECT_THAT(CheckPortMissing(OneAxis("simulate: true"), host), IsEmpty());
  EXPECT_EQ(CheckPortMissing(OneAxis(), host).size(), 1U);
}

// An operator who runs the doctor needs no right to the device: he shall not have it.
TEST(PortPermission, UnderSystemdTheDriversAccountCounts) {
  MachineConfig machine = OneAxis();
  machine.file = "/etc/axlecast/machine.yaml";
  HostFacts host = GoodHost();
  host.groups["axlecast-drivers"] = {};
  HostFile& file = host.ports["/dev/ttyUSB0"].file;
  file.readable = file.writable = false;
  EXPECT_TRUE(CheckPortPermission(machine, host).empty());
  file.readable = file.writable = true;
  file.group = "anna";
  const Symptoms symptoms = CheckPortPermission(machine, host);
  ASSERT_EQ(symptoms.size(), 1U);
  for (const Fix& fix : symptoms[0].fixes) EXPECT_EQ(LineOf(fix).find("usermod"), std::string::npos);
  file.group = "axlecast-drivers";
  EXPECT_TRUE(CheckPortPermission(machine, host).empty());
}

}  // namespace
}  // namespace axlecast
