#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

PortFacts& PortOf(HostFacts& host) { return host.ports["/dev/ttyUSB0"]; }

TEST(PortChecks, AGoodPortIsToldNothingOf) {
  const HostFacts host = GoodHost();
  for (const char* const check : {"port_missing", "port_permission", "port_held", "port_name", "port_prober",
                                  "usb_latency", "adapter_rate", "spi_buffer"}) {
    EXPECT_THAT(RunCheck(check, OneAxis(), host), IsEmpty());
  }
}

TEST(PortChecks, WhatCannotBeLookedAtSaysWhy) {
  HostFacts host = GoodHost();
  PortOf(host).file = Unseen("/dev/ttyUSB0", EACCES);
  EXPECT_THAT(RunCheck("port_missing", OneAxis(), host).at(0).found, HasSubstr("Permission denied"));
  EXPECT_THAT(RunCheck("port_permission", OneAxis(), host), IsEmpty()) << "one symptom is enough";
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
    EXPECT_EQ(!RunCheck("port_permission", OneAxis(), host).empty(), one.found)
        << one.user << ' ' << std::oct << one.mode << ' ' << one.group;
  }
}

TEST(PortChecks, OnlyTheBusOwnDriverMayHoldAPort) {
  HostFacts host = GoodHost();
  PortOf(host).holders = {
      {7, "axlecast-tforma", {"/usr/bin/axlecast-tformat", "--config", "m.yaml", "--bus", "b0"}}};
  EXPECT_THAT(RunCheck("port_held", OneAxis(), host), IsEmpty());
  PortOf(host).holders[0].words.back() = "b1";
  EXPECT_EQ(RunCheck("port_held", OneAxis(), host).size(), 1U);
  PortOf(host).holders = {{8, "minicom", {"minicom", "--bus", "b0"}}, {9, "axlecast-x", {}}};
  const Symptoms symptoms = RunCheck("port_held", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 2U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("process 8 (minicom)"));
}

TEST(PortChecks, ALatencyTimerOfOneMillisecondIsRight) {
  HostFacts host = GoodHost();
  PortOf(host).latency_timer = "/sys/x/latency_timer";
  for (const std::int64_t ms : {0, 1}) {
    PortOf(host).latency_ms = ms;
    EXPECT_THAT(RunCheck("usb_latency", OneAxis(), host), IsEmpty()) << ms;
  }
  PortOf(host).latency_ms = 16;
  const Symptom symptom = RunCheck("usb_latency", OneAxis(), host).at(0);
  EXPECT_THAT(symptom.found, HasSubstr("about 62 exchanges per second"));
  EXPECT_EQ(LineOf(symptom.fixes[0]), "echo 1 > /sys/x/latency_timer");
}

TEST(PortChecks, AnAdapterThatFitsIsNoFinding) {
  HostFacts host = GoodHost();
  PortOf(host).usb = {.vendor = 0x0403, .product = 0x6014, .release = 0x0900};  // FT232H: 2.526 of 2.5 Mbaud
  EXPECT_THAT(RunCheck("adapter_rate", OneAxis(), host), IsEmpty());
  PortOf(host).usb->vendor = 0x1234;  // not known
  EXPECT_THAT(RunCheck("adapter_rate", OneAxis(), host), IsEmpty());
  PortOf(host).usb = {.vendor = 0x0403, .product = 0x6001, .release = 0x0600};  // FT232R
  EXPECT_THAT(RunCheck("adapter_rate", OneAxis(), host).at(0).found, HasSubstr("FT232R"));
}

TEST(PortChecks, ASimulatedBusNeedsNoPort) {
  HostFacts host = GoodHost();
  PortOf(host).file = Unseen("/dev/ttyUSB0", ENOENT);
  EXPECT_THAT(RunCheck("port_missing", OneAxis("simulate: true"), host), IsEmpty());
  EXPECT_EQ(RunCheck("port_missing", OneAxis(), host).size(), 1U);
}

// An operator who runs the doctor needs no right to the device: he shall not have it.
TEST(PortPermission, UnderSystemdTheDriversAccountCounts) {
  MachineConfig machine = OneAxis();
  machine.file = "/etc/axlecast/machine.yaml";
  HostFacts host = GoodHost();
  host.groups["axlecast-drivers"] = {};
  HostFile& file = host.ports["/dev/ttyUSB0"].file;
  file.readable = file.writable = false;
  EXPECT_TRUE(RunCheck("port_permission", machine, host).empty());
  file.readable = file.writable = true;
  file.group = "anna";
  const Symptoms symptoms = RunCheck("port_permission", machine, host);
  ASSERT_EQ(symptoms.size(), 1U);
  for (const Fix& fix : symptoms[0].fixes) EXPECT_EQ(LineOf(fix).find("usermod"), std::string::npos);
  file.group = "axlecast-drivers";
  EXPECT_TRUE(RunCheck("port_permission", machine, host).empty());
}

}  // namespace
}  // namespace axlecast
