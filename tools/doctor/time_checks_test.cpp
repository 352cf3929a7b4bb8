#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(TimeChecks, LimitsAreAskedForOnlyWhereTheFileNeedsThem) {
  HostFacts host = GoodHost();
  host.limits = {.priority = 0, .locked_bytes = 65'536};
  EXPECT_THAT(RunCheck("realtime_priority", OneAxis(), host), IsEmpty());
  EXPECT_THAT(RunCheck("realtime_memory", OneAxis(), host), IsEmpty());
  const MachineConfig machine = OneAxis("realtime: {priority: 60, lock_memory: true}");
  EXPECT_THAT(RunCheck("realtime_priority", machine, host).at(0).fixes.at(0).text, HasSubstr("LimitRTPRIO=60"));
  EXPECT_THAT(RunCheck("realtime_memory", machine, host).at(0).found, HasSubstr("64 kB"));
  host.limits = {.priority = 60, .locked_bytes = -1};
  EXPECT_THAT(RunCheck("realtime_priority", machine, host), IsEmpty());
  EXPECT_THAT(RunCheck("realtime_memory", machine, host), IsEmpty());
}

TEST(TimeChecks, ProcessorsAreReadAsTheKernelListsThem) {
  struct Case {
    const char* online;
    int cpu;
    bool found;
  };
  for (const Case& one : {Case{"0", 0, false}, Case{"0", 1, true}, Case{"0-3,6", 3, false}, Case{"0-3,6", 6, false},
                          Case{"0-3,6", 5, true}, Case{"", 5, false}, Case{"x,-,7", 7, false}}) {
    HostFacts host = GoodHost();
    host.processors.online = one.online;
    const MachineConfig machine = OneAxis("realtime: {cpu: " + std::to_string(one.cpu) + "}");
    EXPECT_EQ(RunCheck("realtime_cpu", machine, host).size(), one.found ? 1U : 0U) << one.online << ' ' << one.cpu;
  }
}

TEST(TimeChecks, GovernorAndClockMatterToAFastBusAlone) {
  HostFacts host = GoodHost();
  host.processors.governors = {{"/sys/cpu0", "schedutil"}, {"/sys/cpu1", "performance"}};
  host.processors.clock_source = "hpet";
  for (const char* slow : {"poll_hz: 999", "simulate: true"}) {
    EXPECT_THAT(RunCheck("cpu_governor", OneAxis(slow), host), IsEmpty()) << slow;
    EXPECT_THAT(RunCheck("clock_source", OneAxis(slow), host), IsEmpty()) << slow;
  }
  const Symptoms governor = RunCheck("cpu_governor", OneAxis("poll_hz: 1000"), host);
  ASSERT_EQ(governor.size(), 1U);
  ASSERT_EQ(governor[0].fixes.size(), 2U) << "the processor that is right already is left alone";
  EXPECT_EQ(LineOf(governor[0].fixes[0]), "echo performance > /sys/cpu0");
  EXPECT_EQ(RunCheck("clock_source", OneAxis("poll_hz: 1000"), host).size(), 1U);
  host.processors.clock_source = "kvm-clock";
  EXPECT_THAT(RunCheck("clock_source", OneAxis("poll_hz: 1000"), host), IsEmpty());
}

TEST(TimeChecks, AnUnsynchronisedClockNamesWhoShouldKeepIt) {
  HostFacts host = GoodHost();
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host), IsEmpty());
  host.clock.synchronised = false;
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host).at(0).found, HasSubstr("nothing keeps"));
  host.processes = {{1, "systemd", {}}, {2, "chronyd", {}}};
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host).at(0).found, HasSubstr("though chronyd runs"));
  host.clock.known = false;
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host), IsEmpty());
}

// Without `rtcsync`, chronyd leaves the kernel in the belief that nothing keeps the clock.
TEST(TimeChecks, ChronydIsAskedBeforeTheKernel) {
  HostFacts host = GoodHost();
  host.clock.synchronised = false;
  host.clock.chrony = ChronyTracking{.reference_id = 0x0A000001, .reference = "10.0.0.1", .root_delay_s = 40e-6};
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host), IsEmpty());
  EXPECT_EQ(ClockText(host), "kept by chronyd from 10.0.0.1, which claims +-0.020 ms");
  host.clock.synchronised = true;
  host.clock.chrony->leap = ChronyTracking::kNotSynchronised;
  EXPECT_THAT(RunCheck("clock_sync", OneAxis(), host).at(0).found,
              HasSubstr("chronyd runs, but follows no server"));
  host.clock.chrony.reset();
  host.processes = {{2, "ptp4l", {}}};
  EXPECT_EQ(ClockText(host), "kept by ptp4l, which states no bound of its error");
}

}  // namespace
}  // namespace axlecast
