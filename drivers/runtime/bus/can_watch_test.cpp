#include "drivers/runtime/bus/bus_health.h"

#include <gmock/gmock.h>

#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "core/alarm/runtime_alarms.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using State = CanController::State;

constexpr MonoNs kTick = 100 * kMillisecond;

class CanWatchTest : public ::testing::Test {
 protected:
  // Snapshots every 100 ms for so long, all alike.
  void Stay(MonoNs time) {
    for (const MonoNs end = now_ + time; now_ < end;) Tick();
  }
  void Tick() { watch_.Update(controller_, now_ += kTick); }

  [[nodiscard]] std::vector<int> Codes() const {
    std::vector<int> codes;
    for (const CanWatch::Alarm& alarm : watch_.alarms()) {
      if (alarm.present) codes.push_back(alarm.spec->code);
    }
    return codes;
  }
  // The worst alarm's code; 0 none.
  [[nodiscard]] int Worst() const {
    const AlarmSpec* const worst = watch_.health().worst;
    return worst != nullptr ? worst->code : 0;
  }
  [[nodiscard]] std::string Trouble() const { return std::string(watch_.health().trouble); }

  CanController controller_{.state = State::kActive, .tec = 0, .rec = 0, .bitrate = 250'000, .restart_ms = 100};
  CanWatch watch_{"can0", 250'000};
  MonoNs now_ = 1'000 * kSecond;
};

TEST_F(CanWatchTest, AHealthyBusHasNoAlarm) {
  controller_.tec = 3;
  controller_.rec = 12;
  Stay(10 * kSecond);
  EXPECT_THAT(Codes(), IsEmpty());
  EXPECT_EQ(Worst(), 0);
  EXPECT_EQ(watch_.health().tec, 3);
  EXPECT_EQ(watch_.health().rec, 12);
  EXPECT_THAT(Trouble(), IsEmpty());
  EXPECT_LE(watch_.revision(), 1);  // the state became known
}

TEST_F(CanWatchTest, AnInterfaceThatTellsNothingHasNone) {
  controller_ = {};
  Stay(kSecond);
  EXPECT_THAT(Codes(), IsEmpty());
  EXPECT_EQ(watch_.health().tec, -1);
  EXPECT_EQ(watch_.health().rec, -1);
}

TEST_F(CanWatchTest, BusOffIsToldAtOnceWithTheLineToType) {
  Stay(kSecond);
  const std::int64_t before = watch_.revision();
  controller_.state = State::kBusOff;
  controller_.restart_ms = 0;
  Tick();
  EXPECT_GT(watch_.revision(), before);
  EXPECT_THAT(Codes(), ElementsAre(210));
  EXPECT_EQ(Worst(), 210);
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("can0: bus-off"), HasSubstr("ip link set can0 down; ip link set can0 up"),
                               HasSubstr("250000 bit/s")));
}

TEST_F(CanWatchTest, BusOffThatRestartsByItselfSaysSo) {
  controller_.state = State::kBusOff;
  Tick();
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("restarts by itself 100 ms later"), Not(HasSubstr("ip link"))));
}

TEST_F(CanWatchTest, ABusOffBetweenTwoLooksIsNotMissedAndStaysForFiveSeconds) {
  Stay(kSecond);
  controller_.bus_offs = 2;
  controller_.restarts = 2;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(210));
  EXPECT_THAT(Trouble(), HasSubstr("was bus-off, 2 times"));
  Stay(4'900 * kMillisecond);
  EXPECT_THAT(Codes(), ElementsAre(210));
  const std::int64_t before = watch_.revision();
  Tick();
  EXPECT_THAT(Codes(), IsEmpty());
  EXPECT_GT(watch_.revision(), before);
  EXPECT_THAT(Trouble(), IsEmpty());
}

// ISO 11898-1: with no other node, the transmit counter of an error-passive node stays where it is.
TEST_F(CanWatchTest, ACounterThatStandsStillAt128MeansThatNobodyAcknowledges) {
  controller_.state = State::kPassive;
  controller_.tec = 128;
  controller_.pending = 1;
  Tick();
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(211));
  EXPECT_EQ(Worst(), 211);
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("nobody acknowledges"), HasSubstr("waiting frames: 1 "),
                               HasSubstr("ip link set can0 down")));
}

TEST_F(CanWatchTest, PassiveForAnotherReasonIsNotTakenForIt) {
  controller_.state = State::kPassive;
  controller_.pending = 1;
  for (const int tec : {128, 136, 144, 200, 131, 140}) {  // it moves: other errors
    controller_.tec = tec;
    Tick();
  }
  EXPECT_THAT(Codes(), ElementsAre(214));
  controller_.pending = 0;  // nothing is being sent
  controller_.tec = 130;
  Stay(kSecond);
  EXPECT_THAT(Codes(), ElementsAre(214));
  controller_.pending = 1;
  controller_.tec = 0;  // it is the receiver that fails
  controller_.rec = 130;
  Stay(kSecond);
  EXPECT_THAT(Codes(), ElementsAre(214));
}

TEST_F(CanWatchTest, MissingAcknowledgesThatTheControllerReportsAreEnough) {
  Stay(kSecond);
  controller_.unacknowledged = 5;
  controller_.pending = 3;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(211));
  EXPECT_THAT(Trouble(), HasSubstr("waiting frames: 3 "));
}

TEST_F(CanWatchTest, TheCountersSayWhetherSendingOrReceivingFails) {
  controller_.state = State::kPassive;
  controller_.tec = 160;
  controller_.rec = 4;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(214));
  EXPECT_EQ(Worst(), 214);
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("error-passive (tec 160, rec 4)"), HasSubstr("sends")));
  controller_.tec = 0;
  controller_.rec = 135;
  Tick();
  EXPECT_THAT(Trouble(), HasSubstr("hears"));
  controller_.state = State::kActive;  // over; the alarm stays for a while
  controller_.rec = 90;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(214));
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("was error-passive"), Not(HasSubstr("rec 90"))));
}

TEST_F(CanWatchTest, ErrorWarningIsForInformationAndGivesWayToWhatIsWorse) {
  controller_.state = State::kWarning;
  controller_.tec = 96;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(216));
  EXPECT_EQ(Worst(), 216);
  EXPECT_THAT(Trouble(), HasSubstr("error-warning"));
  controller_.state = State::kPassive;
  controller_.tec = 136;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(214));
  controller_.state = State::kBusOff;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(210));
}

TEST_F(CanWatchTest, BusErrorsAlarmFromTenASecond) {
  for (int i = 0; i < 50; ++i) {  // five in five seconds
    if (i % 10 == 0) ++controller_.bus_errors;
    Tick();
  }
  EXPECT_THAT(Codes(), IsEmpty());
  for (int i = 0; i < 20; ++i) {
    controller_.bus_errors += 31;
    Tick();
  }
  EXPECT_THAT(Codes(), ElementsAre(213));
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("310 bus errors a second"), HasSubstr("bit rate (250000 bit/s)"),
                               HasSubstr("120 ohm")));
  Stay(4 * kSecond);
  EXPECT_THAT(Codes(), ElementsAre(213));
  Stay(3 * kSecond);
  EXPECT_THAT(Codes(), IsEmpty());
}

TEST_F(CanWatchTest, AFloodOfBusErrorsIsToldWithinTwoLooks) {
  Stay(3 * kSecond);
  controller_.bus_errors += 500;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(213));
}

TEST_F(CanWatchTest, AFullQueueNamesTheLineThatMakesItLonger) {
  Stay(kSecond);
  controller_.queue_full = 1;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(212));
  EXPECT_THAT(Trouble(), HasSubstr("ip link set can0 txqueuelen 100"));
}

TEST_F(CanWatchTest, LostFramesSayWhoLostThem) {
  Stay(kSecond);
  controller_.dropped = 17;
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(215));
  EXPECT_THAT(Trouble(), AllOf(HasSubstr("17 frames lost"), HasSubstr("net.core.rmem_max")));
  controller_.overruns = 4;
  Tick();
  EXPECT_THAT(Trouble(), HasSubstr("the controller lost 4 frames"));
}

TEST_F(CanWatchTest, WhatExplainsMostIsTold) {
  controller_.state = State::kPassive;
  controller_.tec = 128;
  controller_.unacknowledged = 1'000;
  controller_.queue_full = 5;
  controller_.bus_errors = 0;
  Tick();
  Tick();
  EXPECT_THAT(Codes(), ElementsAre(211, 212));
  EXPECT_THAT(Trouble(), HasSubstr("nobody acknowledges"));
}

TEST_F(CanWatchTest, CountsThatBeginAnewAreNoFlood) {
  controller_.bus_errors = 5'000;
  controller_.bus_offs = 7;
  Stay(10 * kSecond);
  EXPECT_THAT(Codes(), IsEmpty());
  controller_.bus_errors = 2;  // opened again
  controller_.bus_offs = 0;
  Stay(kSecond);
  EXPECT_THAT(Codes(), IsEmpty());
}

TEST_F(CanWatchTest, EveryTextFitsIntoItsMessage) {
  std::set<int> codes;
  for (const CanWatch::Alarm& alarm : watch_.alarms()) {
    EXPECT_LE(std::strlen(alarm.spec->name), 24U) << alarm.spec->name;
    EXPECT_LE(std::strlen(alarm.spec->action), 80U) << alarm.spec->name;
    codes.insert(alarm.spec->code);
  }
  EXPECT_THAT(codes, ElementsAre(210, 211, 212, 213, 214, 215, 216));

  // The longest name of an interface (IFNAMSIZ), large numbers; bus_health_t last_error holds 160 bytes.
  constexpr std::int64_t kMany = 1'000'000;
  std::vector<CanController> snapshots(8, {.tec = 255, .rec = 255, .bitrate = kMany, .restart_ms = 10'000});
  snapshots[0].state = State::kBusOff;
  snapshots[1] = snapshots[0];
  snapshots[1].restart_ms = 0;
  snapshots[2].bus_offs = kMany;
  snapshots[3].unacknowledged = kMany;
  snapshots[3].pending = 1'000;
  snapshots[4].queue_full = kMany;
  snapshots[5].state = State::kPassive;
  snapshots[6].dropped = kMany;
  snapshots[7].overruns = kMany;
  for (const CanController& snapshot : snapshots) {
    CanWatch watch("interface-of-15", kMany);
    watch.Update(snapshot, kSecond);
    EXPECT_FALSE(watch.health().trouble.empty());
    EXPECT_LE(watch.health().trouble.size(), 160U) << watch.health().trouble;
  }
  CanWatch watch("interface-of-15", kMany);
  watch.Update({}, kSecond);
  watch.Update({.bitrate = kMany, .bus_errors = kMany}, 2 * kSecond);
  EXPECT_THAT(std::string(watch.health().trouble), HasSubstr("bus errors a second"));
  EXPECT_LE(watch.health().trouble.size(), 160U) << watch.health().trouble;
}

}  // namespace
}  // namespace axlecast
