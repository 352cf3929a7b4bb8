#include <gmock/gmock.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/alarm/alarm_codes.h"
#include "drivers/runtime/bus/bus_health.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 1'000 * kSecond;

BusConfig Config(std::vector<MonoNs> wire_times) {
  BusConfig config;
  config.name = "rs485-0";
  config.link.port = "/dev/serial/by-id/usb-x";
  for (const MonoNs time : wire_times) {
    auto settings = std::make_shared<DeviceSettings>();
    settings->wire_time = time;
    DeviceConfig device;
    device.name = "axis" + std::to_string(config.devices.size() + 1);
    device.settings = settings;
    config.devices.push_back(device);
  }
  return config;
}

class Nobody final : public BusObserver {
 public:
  void OnLink(bool, std::string_view, MonoNs) override {}
};

class BusHealthTest : public ::testing::Test {
 protected:
  BusHealthTest() {
    time_.Update(kStart, clock_.UtcMicroseconds());
    bus_.Add(device_);
  }

  bus_health_t RunUntil(MonoNs until) {
    while (clock_.Now() < kStart + until) bus_.RunOnce(kStart + until);
    tally_.device = "axis1";
    tally_.good = static_cast<std::int64_t>(output_.samples.size());
    tally_.errors = {};
    for (const auto& [kind, at] : output_.errors) ++tally_.errors[static_cast<std::size_t>(kind)];
    health_.Publish(clock_.Now(), bus_, {&tally_, 1});
    return sink_.All<bus_health_t>("BUS/rs485-0").back();
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_, PolledDevices()};
  Timebase time_;
  MemorySink sink_;
  Nobody observer_;
  RecordingOutput output_;
  PolledDevice device_{1, output_};
  Bus bus_{{.schedule = {.ticks = {.period = kMillisecond}}}, link_, clock_, observer_, nullptr};
  BusHealth health_{Config({51 * kMicrosecond}), Origin{.boot_id = 42}, time_, sink_};
  DeviceTally tally_;
};

// TS5669: one ID 3 exchange takes 51 us on the wire, 19.6 k readings a second (device-facts, T-format).
TEST(BusHealthWireLimitTest, FollowsFromTheDevicesWireTimes) {
  EXPECT_NEAR(BusHealth::WireLimit(Config({51 * kMicrosecond})), 19'608, 1);
  EXPECT_NEAR(BusHealth::WireLimit(Config({10 * kMillisecond, 30 * kMillisecond})), 50, 1e-9);
  EXPECT_EQ(BusHealth::WireLimit(Config({10 * kMillisecond, 0})), 0);
  EXPECT_EQ(BusHealth::WireLimit(Config({})), 0);
}

TEST_F(BusHealthTest, RatesCoverTheWindowSinceTheLastMessage) {
  static_cast<void>(RunUntil(0));
  static_cast<void>(RunUntil(kSecond));
  const bus_health_t message = RunUntil(2 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.window_us, 1'000'000);
  EXPECT_EQ(message.exchanges, 2'000);
  EXPECT_EQ(message.good, 2'000);
  EXPECT_NEAR(message.rate_hz, 1'000, 1);
  EXPECT_NEAR(message.wire_limit_hz, 19'608, 1);
  EXPECT_NEAR(message.utilisation, 0.051, 0.0001);
  EXPECT_FLOAT_EQ(message.exchange_us[0], 100);
  EXPECT_NEAR(message.exchange_us[1], 100, 0.8);
  EXPECT_FLOAT_EQ(message.exchange_us[3], 100);
  EXPECT_EQ(message.seq, 2);
  EXPECT_EQ(message.boot_id, 42);
  EXPECT_EQ(message.can_tec, -1);
  EXPECT_THAT(message.last_error, IsEmpty());
}

TEST_F(BusHealthTest, ExchangeTimesAreThoseSinceTheStart) {
  static_cast<void>(RunUntil(kSecond));
  static_cast<void>(RunUntil(2 * kSecond));
  const auto messages = sink_.All<exchange_times_t>("BUS_TIMES/rs485-0");
  ASSERT_EQ(messages.size(), 2U);
  const exchange_times_t& times = messages.back();
  EXPECT_EQ(times.bus, "rs485-0");
  EXPECT_EQ(times.boot_id, 42);
  EXPECT_EQ(times.seq, 1);
  EXPECT_EQ(times.mono_ns, clock_.Now());
  EXPECT_EQ(times.total, 2'000);
  EXPECT_EQ(times.sum_us, 2'000 * 100);
  const auto bound = std::find(times.bound_us.begin(), times.bound_us.end(), 100);
  ASSERT_NE(bound, times.bound_us.end());
  const auto i = static_cast<std::size_t>(bound - times.bound_us.begin());
  EXPECT_EQ(times.within[i], 2'000);
  EXPECT_EQ(times.within[i - 1], 0);
}

TEST_F(BusHealthTest, TimesAreThoseOfTheWindowAlone) {
  int requests = 0;
  link_.SetPeer([&](Bytes request) -> std::vector<ScriptedLink::Burst> {
    const MonoNs after = ++requests == 1 ? 700 * kMicrosecond : 100 * kMicrosecond;
    return {{after, PolledDevice::Reply(request[0], request[1], 0)}};
  });
  EXPECT_FLOAT_EQ(RunUntil(kSecond).exchange_us[3], 700);
  EXPECT_FLOAT_EQ(RunUntil(2 * kSecond).exchange_us[3], 100);
}

TEST_F(BusHealthTest, WithoutAnExchangeTheTimesAreUnknown) {
  link_.RefuseOpens(1'000, "/dev/serial/by-id/usb-x is not there: plug the adapter in");
  const bus_health_t message = RunUntil(kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_DOWN);
  EXPECT_TRUE(std::isnan(message.exchange_us[1]));
  EXPECT_EQ(message.rate_hz, 0);
  EXPECT_THAT(message.last_error, HasSubstr("plug the adapter in"));
  EXPECT_EQ(message.last_error_utime, clock_.UtcMicroseconds());
}

TEST_F(BusHealthTest, ABusThatWasNeverTriedIsStarting) {
  health_.Publish(kStart, bus_, {});
  EXPECT_EQ(sink_.All<bus_health_t>("BUS/rs485-0").back().state, bus_health_t::STATE_STARTING);
}

TEST_F(BusHealthTest, FailedReadingsDegradeItAndTheMostFrequentIsNamed) {
  static_cast<void>(RunUntil(kSecond));
  int requests = 0;
  link_.SetPeer([&](Bytes request) -> std::vector<ScriptedLink::Burst> {
    auto reply = PolledDevice::Reply(request[0], request[1], 0);
    if (++requests % 10 == 0) reply[4] ^= 1;
    return {{100 * kMicrosecond, reply}};
  });
  bus_health_t message = RunUntil(2 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_DEGRADED);
  EXPECT_EQ(message.last_error, "axis1: 100 x checksum");
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kChecksum)], 100);
  EXPECT_EQ(message.good, 1'900);
  const std::int64_t when = message.last_error_utime;
  link_.SetPeer(PolledDevices());
  message = RunUntil(3 * kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.last_error_utime, when);
}

TEST_F(BusHealthTest, ALostLineIsCountedAndReopened) {
  static_cast<void>(RunUntil(0));
  link_.LoseAt(kStart + kSecond / 2);
  bus_health_t message = RunUntil(kSecond / 2);
  EXPECT_EQ(message.state, bus_health_t::STATE_DOWN);
  message = RunUntil(kSecond);
  EXPECT_EQ(message.state, bus_health_t::STATE_UP);
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kIo)], 1);
  EXPECT_EQ(message.reopens, 1);
  EXPECT_THAT(message.last_error, HasSubstr("the line was lost"));
}

TEST_F(BusHealthTest, WhatTheLineItselfSawIsCounted) {
  static_cast<void>(RunUntil(0));
  link_.SetErrors({.framing = 5, .dropped = 7});
  const bus_health_t message = RunUntil(kSecond);
  EXPECT_EQ(message.errors[static_cast<std::size_t>(ErrorKind::kFraming)], 5);
  EXPECT_EQ(message.rx_dropped, 7);
}

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using State = CanController::State;

constexpr MonoNs kTick = 100 * kMillisecond;

class CanWatchTest : public ::testing::Test {
 protected:
  // Equal snapshots every 100 ms for this time.
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
  EXPECT_THAT(Trouble(), HasSubstr("receives"));
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
