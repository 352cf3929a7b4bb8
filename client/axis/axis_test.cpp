// Axes and sets of a connection, in C++ and in C, over udpm:// in a network of the test's own that has multicast.
#include "client/axlecast/axis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <thread>

#include "client/axlecast/axlecast.h"
#include "core/messages/message.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::StrEq;
using Freshness = PositionTracker::Freshness;

constexpr const char* kData = "udpm://239.255.76.67:17677?ttl=0";
constexpr const char* kCommands = "udpm://239.255.76.67:17678?ttl=0";
constexpr std::int64_t kTurn = 131'072;

// A driver of axis1 and of a set, whose messages are sent by the test.
class AxisTest : public testing::Test {
 protected:
  AxisTest() = default;

  static ConnectionSettings Settings() {
    ConnectionSettings settings;
    settings.data_url = kData;
    settings.command_url = kCommands;
    settings.machine = "press1";
    return settings;
  }
  [[nodiscard]] MonoNs Now() const { return clock_.Now(); }

  template <typename Message>
  void Send(const std::string& channel, Message& message) {
    message.boot_id = 7;
    message.machine_id = IdOfName("press1");
    message.clock_id = OwnClockId();
    Publish(port_, channel, message);
  }
  void SendDevice() {
    device_info_t info{};
    info.counts_per_turn = kTurn;
    info.ratio_num = 1;
    info.ratio_den = 1;
    info.per_turn = 360;
    info.unit = position_t::UNIT_DEG;
    info.publish_us = 100'000;
    info.max_age_us = 30'000'000;  // a busy host may be slow
    Send("DEVICE/axis1", info);
  }
  MonoNs SendPosition(std::int64_t counts) {
    position_t position{};
    position.mono_ns = Now();
    position.seq = seq_++;
    position.time_uncertainty_ns = 1'000;
    position.counts_per_turn = kTurn;
    position.counts = counts;
    position.unit = position_t::UNIT_DEG;
    position.flags = position_t::FLAG_VALID;
    position.speed_rad_s = std::nan("");
    position.datum_epoch = 3;
    Send("POSITION/axis1", position);
    return position.mono_ns;
  }
  void SendTime() {
    time_quality_t time{};
    time.mono_ns = Now();
    time.base_ns = time.mono_ns + 5'000'000'000;
    time.base_id = 9;
    time.half_width_ns = 300;
    time.grade = time_quality_t::GRADE_PROVEN;
    time.valid_ms = 60'000;
    time.growth_ppb = 1'000;
    Send("TIME/plc1", time);
  }
  void SendSet(std::int64_t tick) {
    position_set_t set{};
    set.mono_ns = Now();
    set.set = "gantry";
    set.seq = tick;
    set.tick = tick;
    set.base_id = 9;
    set.limit_ns = 50'000;
    set.state = position_set_t::STATE_INCOMPLETE;
    set.axes.resize(2);
    set.axes[0].device = "axis1";
    set.axes[0].counts = 1'234;
    set.axes[1].device = "axis2";
    set.axes[1].state = position_set_axis_t::STATE_MISSING;
    set.n = 2;
    Send("POSITION_SET/gantry", set);
  }
  // Sends until `condition` holds: a message that was sent before a subscription does not arrive.
  template <typename Sends, typename Condition>
  void Until(Sends sends, Condition condition) {
    const MonoNs limit = Now() + 60 * kSecond;
    while (!condition()) {
      ASSERT_LT(Now(), limit);
      sends();
      std::this_thread::yield();
    }
  }

  SystemClock clock_;
  LcmPort port_{kData, ""};
  std::int64_t seq_ = 0;
};

TEST_F(AxisTest, AnswersWithTheNewestReadingAndItsPlaceOnTheBase) {
  Connection connection(Settings());
  ASSERT_EQ(ErrorText(connection.state()), "");
  const Axis axis(connection, "axis1");
  const Axis other(connection, "axis2");
  EXPECT_STREQ(axis.Latest().reason, ReasonText(Freshness::kNoReading));
  Until([&] { SendDevice(), SendTime(), SendPosition(kTurn / 4); },
        [&] { return axis.Latest() && axis.Latest().base; });
  const AxisPosition latest = axis.Latest();
  EXPECT_DOUBLE_EQ(latest.position.value, 90);
  EXPECT_EQ(latest.freshness, Freshness::kFresh);
  EXPECT_EQ(latest.position.datum_epoch, 3);
  EXPECT_EQ(latest.newest.unit, position_t::UNIT_DEG);
  EXPECT_LE(latest.mono_ns, Now());
  EXPECT_EQ(latest.base.base_id, 9);
  EXPECT_LE(std::abs(latest.base.ns - latest.mono_ns - 5'000'000'000), latest.base.half_width_ns);
  EXPECT_GE(latest.base.half_width_ns, 1'300) << "of the base and of the reading";
  EXPECT_STREQ(latest.reason, "");
  EXPECT_EQ(other.Latest().freshness, Freshness::kNoReading);
}

TEST_F(AxisTest, AnswersBetweenReadings) {
  Connection connection(Settings());
  const Axis axis(connection, "axis1");
  MonoNs first = 0;
  MonoNs second = 0;
  Until(
      [&] {
        SendDevice();
        first = SendPosition(1'000);
        second = SendPosition(2'000);
      },
      [&] {
        using Answer = PositionTracker::Answer;
        return axis.At(second).position.answer == Answer::kRead && axis.At(first).position.answer == Answer::kRead;
      });
  EXPECT_NEAR(axis.At(first + (second - first) / 2).position.counts, 1'500, 1);
  EXPECT_STREQ(axis.At(1).reason, ReasonText(PositionTracker::Answer::kBeforeHistory));
  EXPECT_STREQ(axis.At(Now() + 25 * kSecond).reason, ReasonText(PositionTracker::Answer::kTooFarAhead));
}

TEST_F(AxisTest, WithoutAUnitThereIsNoPosition) {
  Connection connection(Settings());
  Axis::Options options;
  options.max_age_ns = 60 * kSecond;
  const Axis axis(connection, "axis1", options);
  Until([&] { SendPosition(1); }, [&] { return axis.Latest().freshness == Freshness::kFresh; });
  EXPECT_FALSE(axis.Latest());
  EXPECT_TRUE(std::isnan(axis.Latest().position.value));
  EXPECT_THAT(axis.Latest().reason, HasSubstr("which states the unit"));
}

TEST_F(AxisTest, MayLiveLongerThanItsConnection) {
  auto connection = std::make_unique<Connection>(Settings());
  const Axis axis(*connection, "axis1");
  Until([&] { SendDevice(), SendPosition(7); }, [&] { return static_cast<bool>(axis.Latest()); });
  connection.reset();
  EXPECT_DOUBLE_EQ(axis.Latest().position.counts, 7);
}

TEST_F(AxisTest, SetsAreReadWithTheirLoss) {
  Connection connection(Settings());
  const PositionSet set(connection, "gantry");
  EXPECT_FALSE(set.Newest());
  Until([&] { SendSet(0); }, [&] { return set.Newest().has_value(); });
  Until([&] { SendSet(4); }, [&] { return set.Newest()->set.tick == 4; });
  EXPECT_EQ(set.Newest()->lost, 3);
  EXPECT_EQ(set.Newest()->set.axes[1].device, "axis2");
}

TEST_F(AxisTest, PermitsStateTheInstantOfTheCallOnBothClocks) {
  std::vector<permit_body_t> permits;
  LcmPort receiver(kCommands, "");
  ASSERT_TRUE(receiver.Subscribe("PERMIT/axis1", [&](const std::string&, Bytes message) {
    const auto permit = DecodeMessage<permit_t>(message);
    if (const auto body = permit ? DecodeMessage<permit_body_t>(permit->permit) : std::nullopt)
      permits.push_back(*body);
  }));
  ConnectionSettings settings = Settings();
  settings.permits = ConnectionSettings::Key();
  Connection connection(settings);
  ASSERT_EQ(ErrorText(connection.state()), "");
  Axis axis(connection, "axis1");
  Until([&] { SendTime(); }, [&] { return static_cast<bool>(connection.OnBase(Now())); });
  const MonoNs before = Now();
  ASSERT_TRUE(axis.Allow({"zero"}, 500));
  const MonoNs after = Now();
  Until([&] { ASSERT_TRUE(receiver.Handle(100)); }, [&] { return !permits.empty(); });
  EXPECT_EQ(permits[0].clock_id, OwnClockId());
  EXPECT_GE(permits[0].issued_mono_ns, before);
  EXPECT_LE(permits[0].issued_mono_ns, after);
  EXPECT_EQ(permits[0].base_id, 9);
  EXPECT_LE(std::abs(permits[0].issued_base_ns - permits[0].issued_mono_ns - 5'000'000'000),
            permits[0].issued_half_width_ns);
  EXPECT_TRUE(axis.Withdraw());
  Until([&] { ASSERT_TRUE(receiver.Handle(100)); }, [&] { return permits.back().n_operations == 0; });
  EXPECT_GT(permits.back().issue, permits[0].issue);
}

// The thread that sends must not renew what the control loop does not ask for any more.
TEST_F(AxisTest, OneCallOfALoopThatStopsIsSentOnce) {
  std::map<std::string, int> permits;
  LcmPort receiver(kCommands, "");
  ASSERT_TRUE(receiver.Subscribe("PERMIT/.*", [&](const std::string& channel, Bytes) { ++permits[channel]; }));
  ConnectionSettings settings = Settings();
  settings.permits = ConnectionSettings::Key();
  Connection connection(settings);
  Axis stopped(connection, "axis1");
  Axis running(connection, "axis2");
  const MonoNs begin = Now();
  ASSERT_TRUE(stopped.Allow({"zero"}, 20));
  // Until the first permit has lapsed several times over, while the thread sends those of the other axis.
  Until(
      [&] {
        ASSERT_TRUE(running.Allow({"zero"}, 20));
        ASSERT_TRUE(receiver.Handle(1));
      },
      [&] { return permits["PERMIT/axis2"] >= 10 && Now() - begin > 100 * kMillisecond; });
  EXPECT_EQ(permits["PERMIT/axis1"], 1);
}

TEST_F(AxisTest, WhatTheSettingsDoNotAskForIsNotSent) {
  Connection connection(Settings());
  Axis axis(connection, "axis1");
  EXPECT_FALSE(axis.Allow({"zero"}, 100));
  EXPECT_FALSE(axis.Withdraw());
  const CommandResult result = axis.Await(axis.Send({}), 0);
  EXPECT_EQ(result.outcome(), CommandOutcome::kNotAccepted);
  EXPECT_THAT(result.problem, HasSubstr("ConnectionSettings::commands"));
  EXPECT_EQ(connection.commands(), nullptr);
}

// -- in C

class CInterfaceTest : public AxisTest {
 protected:
  CInterfaceTest() {
    ax_settings_init(&settings_);
    settings_.data_url = kData;
    settings_.command_url = kCommands;
    settings_.machine = "press1";
  }
  void TearDown() override { ax_disconnect(connection_); }
  ax_axis* Open() {
    connection_ = ax_connect(&settings_, &error_);
    EXPECT_STREQ(error_.text, "");
    return ax_axis_open(connection_, "axis1", nullptr, &error_);
  }

  ax_settings settings_{};
  ax_error error_{};
  ax_connection* connection_ = nullptr;
};

TEST_F(CInterfaceTest, Positions) {
  ax_axis* axis = Open();
  ASSERT_NE(axis, nullptr) << error_.text;
  ax_position position{};
  EXPECT_EQ(ax_axis_latest(axis, &position), AX_NO_POSITION);
  EXPECT_EQ(position.freshness, AX_NO_READING);
  EXPECT_TRUE(std::isnan(position.value));
  EXPECT_THAT(position.reason, StrEq(ax_freshness_text(AX_NO_READING)));
  EXPECT_EQ(position.base.base_id, 0);
  MonoNs at = 0;
  Until([&] { SendDevice(), SendTime(), at = SendPosition(kTurn / 2); },
        [&] { return ax_axis_at(axis, at, &position) == AX_OK && position.base.base_id != 0; });
  EXPECT_DOUBLE_EQ(position.value, 180);
  EXPECT_EQ(position.mono_ns, at);
  EXPECT_EQ(position.unit, position_t::UNIT_DEG);
  EXPECT_EQ(position.flags, AX_FLAG_VALID);
  EXPECT_TRUE(std::isnan(position.speed_rad_s));
  EXPECT_STREQ(position.reason, "");
  ax_instant base{};
  EXPECT_EQ(ax_on_base(connection_, at, &base), AX_OK);
  EXPECT_EQ(base.base_id, 9);
  EXPECT_EQ(ax_axis_at(axis, ax_now_ns() + 100 * kSecond, &position), AX_NO_POSITION);
  ax_axis_close(axis);
}

TEST_F(CInterfaceTest, Sets) {
  connection_ = ax_connect(&settings_, nullptr);
  ax_set* set = ax_set_open(connection_, "gantry", &error_);
  ASSERT_NE(set, nullptr);
  ax_set_reading reading{};
  EXPECT_EQ(ax_set_read(set, &reading), AX_NO_POSITION);
  Until([&] { SendSet(12); }, [&] { return ax_set_read(set, &reading) == AX_OK; });
  EXPECT_EQ(reading.state, AX_SET_INCOMPLETE);
  EXPECT_EQ(reading.tick, 12);
  ASSERT_EQ(reading.n_axes, 2);
  EXPECT_STREQ(reading.axes[0].device, "axis1");
  EXPECT_EQ(reading.axes[0].counts, 1'234);
  EXPECT_EQ(reading.axes[1].state, AX_SET_AXIS_MISSING);
  EXPECT_GE(reading.since_arrival_ns, 0);
  ax_set_close(set);
}

TEST_F(CInterfaceTest, CommandsEndWithoutABridge) {
  settings_.commands = 1;
  ax_axis* axis = Open();
  ASSERT_NE(axis, nullptr);
  ax_command command;
  ax_command_init(&command, "zero");
  ax_id id{};
  ax_result result{};
  ASSERT_EQ(ax_axis_send(axis, &command, &id, &error_), AX_OK);
  EXPECT_EQ(ax_axis_await(axis, &id, 0, &result), AX_NOT_YET);
  EXPECT_EQ(result.under_way, 1);
  EXPECT_EQ(result.outcome, AX_UNKNOWN);
  ASSERT_EQ(ax_axis_cancel(axis, &id), AX_OK);
  ASSERT_EQ(ax_axis_await(axis, &id, 60'000, &result), AX_OK);
  EXPECT_EQ(result.outcome, AX_CANCELLED);
  EXPECT_STREQ(result.reason, "cancelled");
  char text[33];
  ax_id_text(&id, text);
  ax_id parsed{};
  EXPECT_EQ(ax_id_parse(text, &parsed), AX_OK);
  EXPECT_EQ(std::memcmp(&parsed, &id, sizeof id), 0);
  command.valid_ms = 0;
  ASSERT_EQ(ax_axis_send(axis, &command, &id, &error_), AX_OK);
  ASSERT_EQ(ax_axis_await(axis, &id, 60'000, &result), AX_OK);
  EXPECT_EQ(result.outcome, AX_NOT_ACCEPTED);
  EXPECT_THAT(result.text, HasSubstr("valid_ms"));
  ax_axis_close(axis);
}

TEST_F(CInterfaceTest, WrongArgumentsAreErrors) {
  ax_axis* axis = Open();
  const char* const operations[] = {"zero"};
  EXPECT_EQ(ax_connect(nullptr, &error_), nullptr);
  EXPECT_EQ(error_.code, AX_ARGUMENT);
  for (const char* name : {"", "a/b", static_cast<const char*>(nullptr)}) {
    EXPECT_EQ(ax_axis_open(connection_, name, nullptr, &error_), nullptr);
    EXPECT_EQ(ax_set_open(connection_, name, &error_), nullptr);
    EXPECT_EQ(error_.code, AX_ARGUMENT);
  }
  EXPECT_EQ(ax_axis_latest(axis, nullptr), AX_ARGUMENT);
  EXPECT_EQ(ax_axis_latest(nullptr, nullptr), AX_ARGUMENT);
  EXPECT_EQ(ax_axis_allow(axis, operations, 1, 100), AX_UNUSABLE) << "the settings ask for no permits";
  EXPECT_EQ(ax_axis_allow(axis, nullptr, 1, 100), AX_ARGUMENT);
  EXPECT_EQ(ax_axis_withdraw(axis), AX_UNUSABLE);
  EXPECT_EQ(ax_axis_send(axis, nullptr, nullptr, &error_), AX_ARGUMENT);
  EXPECT_EQ(ax_id_parse("12", nullptr), AX_ARGUMENT);
  ax_id id{};
  EXPECT_EQ(ax_id_parse("12", &id), AX_ARGUMENT);
  ax_axis_close(axis);
  ax_axis_close(nullptr);
  settings_.permits = 1;
  settings_.permit_key_file = "/nowhere/key";
  EXPECT_EQ(ax_connect(&settings_, &error_), nullptr);
  EXPECT_EQ(error_.code, AX_UNUSABLE);
  EXPECT_THAT(error_.text, HasSubstr("/nowhere/key"));
}

TEST_F(CInterfaceTest, PermitsAreCheckedBeforeTheyAreSent) {
  settings_.permits = 1;
  ax_axis* axis = Open();
  const char* const operations[] = {"zero", "reset"};
  EXPECT_EQ(ax_axis_allow(axis, operations, 2, 200), AX_OK);
  EXPECT_EQ(ax_axis_allow(axis, operations, 2, 501), AX_ARGUMENT);
  EXPECT_EQ(ax_axis_allow(axis, operations, 25, 200), AX_ARGUMENT);
  EXPECT_EQ(ax_axis_withdraw(axis), AX_OK);
  ax_axis_close(axis);
}

}  // namespace
}  // namespace axlecast
