// DeviceReport: DEVICE as DeviceHealth, Reference and the machine's file give it.
#include <gtest/gtest.h>

#include <axlecast/device_info_t.hpp>
#include <string>
#include <vector>

#include "drivers/runtime/axis/axis_fixture.h"
#include "drivers/runtime/axis/device_health.h"

namespace axlecast {
namespace {

constexpr MonoNs kNow = 1'000 * kSecond;
constexpr std::int64_t kUtcAtZero = 1'700'000'000'000'000;

class DeviceReportTest : public testing::Test {
 protected:
  DeviceReportTest() {
    time_.Update(0, kUtcAtZero);
    device_.config.ratio_num = 3;
    device_.config.ratio_den = 2;
    device_.config.publish_hz = 100;
  }
  device_info_t Written() {
    DeviceReport report(device_.bus, device_.config, {.boot_id = 5});
    return report.Write(health_, Reference(device_.config), time_, kNow);
  }

  TestDevice device_;
  DeviceHealth health_{kMillisecond};
  Timebase time_;
};

TEST_F(DeviceReportTest, HasTheSettingsOfTheDevice) {
  const device_info_t info = Written();
  EXPECT_EQ(info.boot_id, 5);
  EXPECT_EQ(info.seq, 0);
  EXPECT_EQ(info.mono_ns, kNow);
  EXPECT_EQ(info.utime, kUtcAtZero + kNow / kMicrosecond);
  EXPECT_EQ(info.device, "axis1");
  EXPECT_EQ(info.bus, "rs485-0");
  EXPECT_EQ(info.family, "");
  EXPECT_EQ(info.model, "ts5669n127");
  EXPECT_EQ(info.identity, -1) << "unknown";
  EXPECT_EQ(info.counts_per_turn, TestDevice::kTurn);
  EXPECT_EQ(info.turns_range, TestDevice::kRange);
  EXPECT_EQ(info.ratio_num, 3);
  EXPECT_EQ(info.ratio_den, 2);
  EXPECT_EQ(info.poll_us, 1'000);
  EXPECT_EQ(info.publish_us, 10'000);
  EXPECT_EQ(info.max_age_us, 30'000) << "three messages";
  EXPECT_EQ(info.tick_period_ns, 0) << "it is not read on ticks";
  EXPECT_EQ(info.last_good_utime, 0);
}

TEST_F(DeviceReportTest, AReadingIsStaleAfterThreeThatAreMissingButNotBefore20Ms) {
  EXPECT_EQ(DeviceReport::MaxAge(kMillisecond, kMillisecond), 20 * kMillisecond);
  EXPECT_EQ(DeviceReport::MaxAge(7 * kMillisecond, kMillisecond), 21 * kMillisecond);
  EXPECT_EQ(DeviceReport::MaxAge(kMillisecond, 7 * kMillisecond), 21 * kMillisecond);
}

TEST_F(DeviceReportTest, ThePeriodOfADeviceIsItsOwnOrTheOneOfItsBus) {
  EXPECT_EQ(PollPeriod(device_.bus, device_.config), kMillisecond);
  device_.settings->own_period = 5 * kMillisecond;
  EXPECT_EQ(PollPeriod(device_.bus, device_.config), 5 * kMillisecond);
  device_.settings->own_period = 1;
  EXPECT_EQ(PollPeriod(device_.bus, device_.config), 1);
  device_.settings->own_period = 0;
  device_.bus.poll_hz = 0;
  device_.settings->wire_time = 51 * kMicrosecond;
  device_.bus.devices = {device_.config, device_.config};
  EXPECT_EQ(PollPeriod(device_.bus, device_.config), 102 * kMicrosecond) << "a round of the bus";
  EXPECT_EQ(Written().poll_us, 0) << "as fast as the bus allows";
}

TEST_F(DeviceReportTest, IdentityAndProductAreNewOnceEach) {
  DeviceReport report(device_.bus, device_.config, {.boot_id = 5});
  EXPECT_EQ(report.identity(), "");
  const std::int64_t before = report.revision();
  report.SetIdentity(17, "SN0042", "1.2");
  EXPECT_EQ(report.revision(), before + 1);
  EXPECT_EQ(report.identity(), "17 SN0042");
  report.SetIdentity(17, "SN0042", "1.2");
  EXPECT_EQ(report.revision(), before + 1);
  report.SetIdentity(17, "SN0042", "1.3");
  EXPECT_EQ(report.revision(), before + 2);
  report.SetIdentity(17, "SN0043", "1.3");
  EXPECT_EQ(report.revision(), before + 3);
  report.SetIdentity(0, "", "1.3");
  EXPECT_EQ(report.identity(), "0");
  report.SetIdentity(-1, "SN0042", "1.3");
  EXPECT_EQ(report.identity(), "SN0042");
  const std::int64_t code = report.revision();
  report.SetProductCode("TS5669");
  report.SetProductCode("TS5669");
  EXPECT_EQ(report.revision(), code + 1);
  report.CountNonVolatileWrite();
  EXPECT_EQ(report.revision(), code + 2);
  const device_info_t info = report.Write(health_, Reference(device_.config), time_, kNow);
  EXPECT_EQ(info.identity, -1);
  EXPECT_EQ(info.serial, "SN0042");
  EXPECT_EQ(info.firmware, "1.3");
  EXPECT_EQ(info.product_code, "TS5669");
  EXPECT_EQ(info.nv_writes, 1);
}

TEST_F(DeviceReportTest, HasTheCountsOfItsErrorsAndTheDatum) {
  health_.OnGood(kNow - kSecond);
  health_.OnFailure(ErrorKind::kTimeout, kNow);
  health_.OnFailure(ErrorKind::kChecksum, kNow);
  health_.OnFailure(ErrorKind::kChecksum, kNow);
  Reference reference(device_.config);
  reference.Set({500, 77}, kNow, kNow);
  reference.Lose(kNow);
  DeviceReport report(device_.bus, device_.config, {.boot_id = 5});
  static_cast<void>(report.Write(health_, reference, time_, kNow));
  const device_info_t info = report.Write(health_, reference, time_, kNow);
  EXPECT_EQ(info.seq, 1);
  EXPECT_EQ(info.good, 1);
  EXPECT_EQ(info.errors[static_cast<int>(ErrorKind::kTimeout)], 1);
  EXPECT_EQ(info.errors[static_cast<int>(ErrorKind::kChecksum)], 2);
  EXPECT_EQ(info.last_good_utime, kUtcAtZero + (kNow - kSecond) / kMicrosecond);
  EXPECT_EQ(info.datum_counts, 500);
  EXPECT_EQ(info.datum_utime, 77);
  EXPECT_EQ(info.datum_epoch, 1);
  EXPECT_EQ(info.reference_lost, 1);
}

bool PermitsBump(const BusConfig& /*bus*/, const DeviceConfig& /*device*/, std::string_view operation) {
  return operation == "bump";
}

TEST_F(DeviceReportTest, ListsTheOperationsThatTheConfigurationPermits) {
  static const std::vector<OperationSpec> kOperations = {{.name = "bump", .help = ""},
                                                         {.name = "write", .help = ""},
                                                         {.name = "secret", .help = "", .internal = true}};
  Family family;
  family.name = "counting";
  family.operations = kOperations;
  family.has_position = false;
  device_.bus.family = &family;
  const std::vector<std::string> of_alarms = {"acknowledge_alarm", "shelve_alarm", "unshelve_alarm"};
  std::vector<std::string> all = {"bump", "write"};
  all.insert(all.end(), of_alarms.begin(), of_alarms.end());
  EXPECT_EQ(Written().family, "counting");
  EXPECT_EQ(Written().operations, all);
  EXPECT_EQ(Written().n_operations, 5);
  family.permits = &PermitsBump;
  all.erase(all.begin() + 1);
  EXPECT_EQ(Written().operations, all);
}

TEST_F(DeviceReportTest, ADeviceThatIsReadOnTicksStatesThem) {
  const Family family;
  device_.bus.family = &family;
  device_.bus.phase = 77;
  device_.bus.poll_hz = 250;
  device_.settings->latch_after = 33;
  device_.bus.devices = {device_.config};
  const device_info_t info = Written();
  EXPECT_EQ(info.tick_period_ns, 4 * kMillisecond);
  EXPECT_EQ(info.tick_phase_ns, 77);
  EXPECT_EQ(info.tick_lead_ns, 33);
  EXPECT_EQ(info.max_age_us, 30'000);
}

TEST_F(DeviceReportTest, ASlowRateIsStatedAsFarAsItFits) {
  device_.bus.poll_hz = 1;
  device_.config.publish_hz = 0.0001;
  const device_info_t info = Written();
  EXPECT_EQ(info.poll_us, 1'000'000);
  EXPECT_EQ(info.publish_us, INT32_MAX);
  EXPECT_EQ(info.max_age_us, INT32_MAX);
  device_.config.publish_hz = 0;
  EXPECT_EQ(Written().publish_us, 0);
  EXPECT_EQ(Written().max_age_us, 3'000'000);
}

TEST_F(DeviceReportTest, TheReasonIsThePresentOne) {
  DeviceReport report(device_.bus, device_.config, {.boot_id = 5});
  EXPECT_EQ(report.Write(health_, Reference(device_.config), time_, kNow).reason, "nothing read yet");
  health_.OnRefused("wrong model", kNow);
  EXPECT_EQ(report.Write(health_, Reference(device_.config), time_, kNow).reason, "wrong model");
  EXPECT_EQ(report.Write(health_, Reference(device_.config), time_, kNow).state, device_info_t::STATE_OFFLINE);
}

}  // namespace
}  // namespace axlecast
