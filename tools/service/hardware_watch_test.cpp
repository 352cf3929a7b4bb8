#include "tools/service/hardware_watch.h"
#include "core/messages/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/alarm_t.hpp>
#include <cmath>
#include <vector>

namespace axlecast {
namespace {

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
    for (const FindingGroup& group : watch_.Judge()) {
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
  EXPECT_FALSE(watch_.Heard());
  After(1'000);
  EXPECT_TRUE(watch_.Heard());
  EXPECT_EQ(watch_.readings(), 1'000);
  EXPECT_EQ(Of("good readings").value, "1000 of 1000");
  EXPECT_EQ(Of("turnaround").value, "min 90 us, p50 110 us, p99 150 us");
  EXPECT_EQ(Of("alarms").verdict, Verdict::kGood);
  EXPECT_LE(Worst(watch_.Judge()), Verdict::kUnjudged);
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
  EXPECT_EQ(Worst(watch_.Judge()), Verdict::kBad);
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
  EXPECT_FALSE(watch_.Heard());
}

TEST(JudgeRotation, DirectionAndCounts) {
  EXPECT_EQ(JudgeRotation(1.02, 1).verdict, Verdict::kGood);
  EXPECT_EQ(JudgeRotation(0, 1).verdict, Verdict::kBad);
  EXPECT_THAT(JudgeRotation(-1, 1).advice, HasSubstr("direction: cw"));
  EXPECT_THAT(JudgeRotation(-1, -1).advice, HasSubstr("direction: ccw"));
  EXPECT_EQ(JudgeRotation(2, 1).verdict, Verdict::kAttention);
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
