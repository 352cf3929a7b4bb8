#include "tools/service/hardware_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/messages/message.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr double kTurn = 131'072;

struct Settings final : DeviceSettings {};

class MotionWatchTest : public ::testing::Test {
 protected:
  MotionWatchTest() {
    auto settings = std::make_shared<Settings>();
    settings->max_speed_rpm = 6'000;
    settings->max_accel_rad_s2 = 80'000;
    device_.settings = settings;
  }

  // A second of positions, 1,000 of them; `angle` in rad at a time in s, read with 4 counts of noise.
  template <typename Angle>
  void Watch(Angle angle) {
    for (int i = 0; i < 1'000; ++i) {
      position_t position{};
      position.boot_id = 1;
      position.counts_per_turn = static_cast<std::int32_t>(kTurn);
      position.mono_ns = begin_ + i * 1'000'000LL;
      position.counts = static_cast<std::int64_t>(std::llround(angle(i * 1e-3) / (2 * std::numbers::pi) * kTurn)) +
                        (i * 7 % 9) - 4;
      watch_.On(position);
    }
    begin_ += 1'000'000'000LL;
  }
  AcceptanceResult Limits() const { return watch_.Evaluate(device_).findings.at(1); }

  DeviceConfig device_;
  MotionWatch watch_;
  std::int64_t begin_ = 5'000'000'000LL;
};

// 100 rad/s peak at 1 Hz: 955 rpm, 628 rad/s2. The noise of 8 counts within 20 ms is 2 rad/s2.
TEST_F(MotionWatchTest, ProposesLimitsWithAMargin) {
  Watch([](double t) { return 100 / (2 * std::numbers::pi) * std::sin(2 * std::numbers::pi * t); });
  EXPECT_NEAR(watch_.speed_rpm(), 955, 10);
  EXPECT_NEAR(watch_.accel_rad_s2(), 628, 10);
  EXPECT_EQ(Limits().what, "limits of the model only");
  EXPECT_EQ(Limits().value, "6000 rpm, 80000 rad/s2");
  EXPECT_EQ(Limits().verdict, Verdict::kUnjudged);
  EXPECT_THAT(Limits().advice, HasSubstr("limits: {speed_rpm: 1500, accel_rad_s2: 1300} in the machine's file"));
}

TEST_F(MotionWatchTest, AShaftThatStandsProposesNothing) {
  Watch([](double) { return 1.0; });
  EXPECT_LT(watch_.speed_rpm(), 1);
  EXPECT_THAT(Limits().advice, HasSubstr("run it again while the axis makes its fastest motions"));
}

TEST_F(MotionWatchTest, OwnLimitsThatAreNearlyReachedArePointedOut) {
  device_.speed_rpm = 3'000;
  device_.accel_rad_s2 = 5'000;
  const auto at = [](double rad_s) { return [rad_s](double t) { return rad_s * t; }; };
  Watch(at(100));
  EXPECT_EQ(Limits().what, "limits of the axis");
  EXPECT_EQ(Limits().verdict, Verdict::kGood);
  begin_ += 2'000'000'000LL;  // nobody saw how it became faster
  Watch(at(260));
  EXPECT_NEAR(watch_.speed_rpm(), 2'483, 5);
  EXPECT_EQ(Limits().verdict, Verdict::kAttention);
  EXPECT_THAT(Limits().advice, HasSubstr("limits: {speed_rpm: 3800"));
}

TEST_F(MotionWatchTest, AJumpWithoutMotionIsNoMotion) {
  Watch([](double) { return 1.0; });
  position_t zeroed{};
  zeroed.boot_id = 1;
  zeroed.datum_epoch = 1;
  zeroed.counts_per_turn = static_cast<std::int32_t>(kTurn);
  zeroed.mono_ns = begin_ + 30'000'000;
  watch_.On(zeroed);
  EXPECT_LT(watch_.speed_rpm(), 1);
}

TEST(ProposedLimit, IsRoundedUpAndAtMostTheModels) {
  EXPECT_DOUBLE_EQ(ProposedLimit(955, 1.5, 6'000), 1'500);
  EXPECT_DOUBLE_EQ(ProposedLimit(1'000, 1.5, 6'000), 1'500);
  EXPECT_DOUBLE_EQ(ProposedLimit(5'000, 1.5, 6'000), 6'000);
  EXPECT_DOUBLE_EQ(ProposedLimit(5'000, 2, 0), 10'000);
  EXPECT_DOUBLE_EQ(ProposedLimit(0, 2, 0), 1);
}

using ::testing::HasSubstr;
using ::testing::Not;

class HardwareWatchTest : public ::testing::Test {
 protected:
  HardwareWatchTest() {
    bus_config_.name = "rs485-0";
    device_.name = "axis1";
    info_.state = device_info_t::STATE_ONLINE;
    bus_.state = bus_health_t::STATE_UP;
    bus_.wire_limit_hz = 10'000;
    const float us[4] = {90, 110, 150, 200};
    std::copy(std::begin(us), std::end(us), bus_.exchange_us);
    Send();
  }

  void Send() {
    watch_.OnMessage("DEVICE/axis1", Encoded(info_));
    watch_.OnMessage("BUS/rs485-0", Encoded(bus_));
    watch_.OnMessage("ALARM/axis1", Encoded(alarms_));
  }
  void After(std::int64_t good, std::int64_t timeouts = 0) {
    info_.good += good;
    info_.errors[device_info_t::ERROR_TIMEOUT] += timeouts;
    bus_.exchanges += good + timeouts;
    Send();
  }
  AcceptanceResult Of(const std::string& what) const {
    for (const FindingGroup& group : watch_.Evaluate()) {
      for (const AcceptanceResult& finding : group.findings) {
        if (finding.what == what) return finding;
      }
    }
    ADD_FAILURE() << "no finding " << what;
    return {};
  }

  BusConfig bus_config_;
  DeviceConfig device_;
  device_info_t info_{};
  bus_health_t bus_{};
  alarm_t alarms_{};
  HardwareWatch watch_{bus_config_, device_};
};

TEST_F(HardwareWatchTest, AGoodDevice) {
  EXPECT_FALSE(watch_.Complete());
  After(1'000);
  EXPECT_TRUE(watch_.Complete());
  EXPECT_EQ(watch_.readings(), 1'000);
  EXPECT_EQ(Of("good readings").value, "1000 of 1000");
  EXPECT_EQ(Of("turnaround").value, "min 90 us, p50 110 us, p99 150 us");
  EXPECT_EQ(Of("alarms").verdict, Verdict::kGood);
  EXPECT_LE(Worst(watch_.Evaluate()), Verdict::kUnjudged);
}

TEST_F(HardwareWatchTest, WhatWasBeforeTheWatchDoesNotCount) {
  info_.good = 5'000;
  info_.errors[0] = 700;
  info_.boot_id = 2;
  Send();
  After(100);
  EXPECT_EQ(Of("good readings").value, "100 of 100");
}

TEST_F(HardwareWatchTest, FailedReadingsByKindWithAdvice) {
  After(100'000, 1);
  EXPECT_EQ(Of("good readings").verdict, Verdict::kAttention);
  EXPECT_EQ(Of("failed: timeout").value, "1");
  EXPECT_THAT(Of("failed: timeout").advice, HasSubstr("A and B"));
  After(0, 1'000);
  EXPECT_EQ(Of("failed: timeout").verdict, Verdict::kBad);
  EXPECT_EQ(Worst(watch_.Evaluate()), Verdict::kBad);
}

TEST_F(HardwareWatchTest, NoReadingAtAll) {
  After(0);
  EXPECT_EQ(Of("good readings").verdict, Verdict::kBad);
  EXPECT_THAT(Of("good readings").advice, HasSubstr("watch longer"));
  info_.reason = "no reply for 3 s";
  After(0);
  EXPECT_EQ(Of("good readings").advice, "no reply for 3 s");
  bus_.state = bus_health_t::STATE_DOWN;
  bus_.last_error = "/dev/ttyUSB0 does not exist: plug the adapter in";
  After(0);
  EXPECT_EQ(Of("good readings").advice, "the bus is down: /dev/ttyUSB0 does not exist: plug the adapter in");
}

TEST_F(HardwareWatchTest, AdviceFollowsTheLineAndWhetherSomeReadingsAreGood) {
  After(0, 100);
  EXPECT_THAT(Of("failed: timeout").advice, HasSubstr("nothing answers: wires A and B"));
  After(1'000, 1);
  EXPECT_THAT(Of("failed: timeout").advice, HasSubstr("it answers, not always: a loose contact"));
  for (const auto& [link, says] : {std::pair{LinkKind::kCan, "CAN_H"}, {LinkKind::kSpi, "clock and data lines"}}) {
    const Family family{.name = "made_up", .summary = "", .link = link, .operations = {}};
    EXPECT_THAT(ErrorAdvice(device_info_t::ERROR_TIMEOUT, &family, false), HasSubstr(says));
    EXPECT_THAT(ErrorAdvice(device_info_t::ERROR_TIMEOUT, &family, false), Not(HasSubstr("A and B")));
  }
}

TEST_F(HardwareWatchTest, ASlowAdapter) {
  bus_.exchange_us[1] = 16'000;
  bus_.exchange_us[2] = 17'000;
  After(100);
  EXPECT_EQ(Of("turnaround").verdict, Verdict::kAttention);
  EXPECT_THAT(Of("turnaround").advice, HasSubstr("latency timer"));
}

TEST_F(HardwareWatchTest, AnUnevenHost) {
  bus_.exchange_us[2] = 30'000;
  After(100);
  EXPECT_THAT(Of("turnaround").advice, HasSubstr("uneven"));
}

TEST_F(HardwareWatchTest, APluggedCable) {
  bus_.reopens = 1;
  bus_.late = 50;
  After(100);
  EXPECT_EQ(Of("line").verdict, Verdict::kBad);
  EXPECT_THAT(Of("rate").advice, HasSubstr("50 slots missed"));
}

TEST_F(HardwareWatchTest, AlarmsWithTheirActions) {
  alarms_.n = 1;
  alarms_.entries.resize(1);
  alarms_.entries[0].name = "battery_error";
  alarms_.entries[0].severity = alarm_entry_t::SEVERITY_ERROR;
  alarms_.entries[0].action = "Exchange the battery.";
  After(100);
  EXPECT_EQ(Of("battery_error").verdict, Verdict::kBad);
  EXPECT_EQ(Of("battery_error").advice, "Exchange the battery.");
}

TEST_F(HardwareWatchTest, AnOfflineDevice) {
  info_.state = device_info_t::STATE_OFFLINE;
  info_.reason = "no reply";
  After(100);
  EXPECT_EQ(Of("state").value, "OFFLINE: no reply");
  EXPECT_EQ(Of("state").verdict, Verdict::kBad);
}

TEST_F(HardwareWatchTest, DamagedMessagesSayNothing) {
  const std::vector<std::uint8_t> whole = Encoded(info_);
  for (std::size_t size = 0; size < whole.size(); ++size)
    watch_.OnMessage("DEVICE/axis1", Bytes(whole.data(), size));
  EXPECT_FALSE(watch_.Complete());
}

TEST(JudgeRotation, DirectionAndCounts) {
  EXPECT_EQ(EvaluateRotation(1.02, 1).verdict, Verdict::kGood);
  EXPECT_EQ(EvaluateRotation(0, 1).verdict, Verdict::kBad);
  EXPECT_THAT(EvaluateRotation(-1, 1).advice, HasSubstr("direction: cw"));
  EXPECT_THAT(EvaluateRotation(-1, -1).advice, HasSubstr("direction: ccw"));
  EXPECT_EQ(EvaluateRotation(2, 1).verdict, Verdict::kAttention);
}

TEST(Findings, AsTextAndJson) {
  const Findings findings = {
      {"Line", {{"adapter", "0403:6014", Verdict::kGood, ""}, {"latency", "16 ms", Verdict::kAttention, "1 ms"}}}};
  EXPECT_THAT(FindingsText(findings), HasSubstr("attention"));
  EXPECT_EQ(FindingsJson(findings)[1]["verdict"], "attention");
  EXPECT_EQ(Worst(findings), Verdict::kAttention);
  HtmlPage page("t");
  AddFindings(page, findings);
  EXPECT_THAT(page.Text(), HasSubstr("<td class=\"attention\">attention</td>"));
}

}  // namespace

}  // namespace axlecast
