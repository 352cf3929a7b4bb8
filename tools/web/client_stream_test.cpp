#include "tools/web/client_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <nlohmann/json.hpp>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

template <typename Request>
Request As(std::string_view text) {
  const Result<PageRequest> request = ParsePageRequest(text);
  const bool expected = request && std::holds_alternative<Request>(*request);
  EXPECT_TRUE(expected) << text;
  return expected ? std::get<Request>(*request) : Request{};
}

std::string ErrorOf(std::string_view text) { return ErrorText(ParsePageRequest(text)); }

TEST(PageRequest, IsUnderstood) {
  EXPECT_EQ(As<SubscribeRequest>(R"({"type":"subscribe","devices":["axis1","gm1"],"history_s":120})"),
            (SubscribeRequest{{"axis1", "gm1"}, 120}));
  EXPECT_EQ(As<SubscribeRequest>(R"({"devices":[],"type":"subscribe","later":{"a":1}})"), SubscribeRequest{});
  EXPECT_EQ(As<SeekRequest>(R"({"type":"seek","utime":1790000000000001})"), SeekRequest{1'790'000'000'000'001});
  EXPECT_EQ(As<PlayRequest>(R"({"type":"play"})"), PlayRequest{true});
  EXPECT_EQ(As<PlayRequest>(R"({"type":"pause"})"), PlayRequest{false});
  EXPECT_EQ(As<SpeedRequest>(R"({"type":"speed","factor":2.5})"), SpeedRequest{2.5});
}

TEST(PageRequest, IsRefusedWithWhatIsWrong) {
  EXPECT_THAT(ErrorOf(""), HasSubstr("no JSON object"));
  EXPECT_THAT(ErrorOf("[1]"), HasSubstr("no JSON object"));
  EXPECT_THAT(ErrorOf("{}"), HasSubstr("without a type"));
  EXPECT_THAT(ErrorOf(R"({"type":7})"), HasSubstr("without a type"));
  EXPECT_THAT(ErrorOf(R"({"type":"command","operation":"zero"})"), HasSubstr("accepts no commands"));
  EXPECT_THAT(ErrorOf(R"({"type":"subscribe"})"), HasSubstr("not a list"));
  EXPECT_THAT(ErrorOf(R"({"type":"subscribe","devices":[1]})"), HasSubstr("not a list"));
  EXPECT_THAT(ErrorOf(R"({"type":"subscribe","devices":[],"history_s":-1})"), HasSubstr("history_s"));
  EXPECT_THAT(ErrorOf(R"({"type":"seek","utime":"now"})"), HasSubstr("utime"));
  EXPECT_THAT(ErrorOf(R"({"type":"seek","utime":1e300})"), HasSubstr("utime"));
  EXPECT_THAT(ErrorOf(R"({"type":"speed","factor":0})"), HasSubstr("factor"));
  EXPECT_THAT(ErrorOf(R"({"type":"speed"})"), HasSubstr("factor"));
}

TEST(PageRequest, OfDeepNestingIsRefused) {
  EXPECT_THAT(ErrorOf(std::string(100'000, '[')), HasSubstr("no JSON object"));
  EXPECT_THAT(ErrorOf(R"({"type":"subscribe","devices":)" + std::string(8000, '[') + std::string(8000, ']') + '}'),
              HasSubstr("not a list"));
}

TEST(PageRequest, OfTooManyDevicesIsRefused) {
  std::string devices;
  for (std::size_t i = 0; i <= kMaxSubscribed; ++i) devices += (i == 0 ? "\"d" : ",\"d") + std::to_string(i) + '"';
  EXPECT_THAT(ErrorOf(R"({"type":"subscribe","devices":[)" + devices + "]}"), HasSubstr("too many"));
}

using Json = nlohmann::json;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Gt;
using ::testing::IsEmpty;

constexpr std::int64_t kStart = 1'790'000'000'000'000;

alarm_t AlarmMessage(std::int64_t revision, const std::vector<std::string>& names) {
  alarm_t alarm{};
  alarm.device = "axis1";
  alarm.revision = revision;
  alarm.total = static_cast<std::int16_t>(names.size());
  alarm.n = static_cast<std::int8_t>(names.size());
  for (const std::string& name : names) {
    alarm_entry_t& entry = alarm.entries.emplace_back();
    entry = {};
    entry.name = name;
    entry.severity = alarm_entry_t::SEVERITY_WARNING;
    entry.action = "replace the battery";
  }
  return alarm;
}

class WebFeedTest : public ::testing::Test {
 protected:
  WebFeedTest() { feed_.Start(model_, Now()); }

  [[nodiscard]] WebTimestamp Now() const { return {kSecond + now_, kStart + now_ / kMicrosecond}; }
  template <typename Message>
  void Hear(const std::string& channel, const Message& message) {
    model_.OnMessage(channel, Encoded(message), Now());
  }
  // `count` readings, 10 ms apart; their values are their numbers.
  void HearReadings(int count) {
    for (int i = 0; i < count; ++i) {
      position_t position = PositionMessage(readings_);
      position.utime = Now().utime;
      position.value = readings_++;
      Hear("POSITION/axis1", position);
      now_ += 10 * kMillisecond;
    }
  }
  // All that a browser that takes everything gets now.
  std::vector<Json> Read(const std::string& type = "") {
    std::vector<Json> frames;
    while (const auto frame = feed_.Next(model_, Now())) {
      const Json json = Json::parse(*frame);
      if (type.empty() || json["type"] == type) frames.push_back(json);
    }
    return frames;
  }
  static std::vector<std::string> Types(const std::vector<Json>& frames) {
    std::vector<std::string> types;
    for (const Json& frame : frames) types.push_back(frame["type"]);
    return types;
  }
  Result<> Subscribe(double history_s = 0) {
    return feed_.Subscribe(model_, {.devices = {"axis1"}, .history_s = history_s}, Now());
  }
  static std::vector<int> Values(const std::vector<Json>& frames) {
    std::vector<int> values;
    for (const Json& frame : frames) {
      for (const Json& value : frame["columns"]["value"]) values.push_back(value.get<int>());
    }
    return values;
  }

  MachineConfig machine_ = OneAxis();
  WebModel model_{machine_, "1.2.3", std::nullopt};
  ClientStream feed_;
  MonoNs now_ = 0;
  int readings_ = 0;
};

TEST_F(WebFeedTest, BeginsWithWhatTheMachineIs) {
  Hear("ALARM/axis1", AlarmMessage(1, {"battery_low"}));
  feed_.Start(model_, Now());
  const std::vector<Json> frames = Read();
  EXPECT_THAT(Types(frames), ElementsAre("hello", "state", "alarms"));
  EXPECT_EQ(frames[0]["machine"], "press3");
  EXPECT_EQ(frames[0]["version"], "1.2.3");
  EXPECT_EQ(frames[0]["devices"][0]["device"], "axis1");
  EXPECT_EQ(frames[0]["buses"][0]["devices"][0], "axis1");
  EXPECT_EQ(frames[1]["devices"][0]["state"], nullptr);
  EXPECT_EQ(frames[2]["appeared"], Json({"battery_low"}));
  EXPECT_EQ(frames[2]["entries"][0]["action"], "replace the battery");
}

TEST_F(WebFeedTest, TellsTheNewestStateFourTimesASecond) {
  Read();
  Hear("DEVICE/axis1", DeviceMessage(device_info_t::STATE_ONLINE));
  for (int i = 0; i < 100; ++i) {
    now_ += 10 * kMillisecond;
    HearReadings(0);
    Hear("POSITION/axis1", PositionMessage(i));
  }
  std::vector<Json> states = Read("state");
  ASSERT_EQ(states.size(), 1U);  // a browser that slept for a second
  EXPECT_EQ(states[0]["devices"][0]["state"], "ONLINE");
  EXPECT_EQ(states[0]["devices"][0]["reading"]["turns"], 12.5);
  int told = 0;
  for (int i = 0; i < 100; ++i) {
    now_ += 10 * kMillisecond;
    told += static_cast<int>(Read("state").size());
  }
  EXPECT_EQ(told, 4);
}

TEST_F(WebFeedTest, TellsEveryAlarmHoweverSlowTheBrowserIs) {
  Read();
  for (int i = 1; i <= 500; ++i) {
    Hear("ALARM/axis1", AlarmMessage(2 * i, {"battery_low"}));
    Hear("ALARM/axis1", AlarmMessage(2 * i, {"battery_low"}));  // once a second, without news
    Hear("ALARM/axis1", AlarmMessage(2 * i + 1, {}));
  }
  const std::vector<Json> alarms = Read("alarms");
  ASSERT_EQ(alarms.size(), 1000U);
  for (std::size_t i = 0; i < alarms.size(); ++i) {
    EXPECT_EQ(alarms[i][i % 2 == 0 ? "appeared" : "cleared"], Json({"battery_low"})) << i;
  }
  EXPECT_FALSE(feed_.fell_behind(model_));
}

TEST_F(WebFeedTest, KnowsWhenAnAlarmWouldBeLost) {
  Read();
  for (std::size_t i = 0; i <= WebModel::kMaxEvents; ++i) {
    EXPECT_FALSE(feed_.fell_behind(model_)) << i;
    Hear("ALARM/axis1", AlarmMessage(static_cast<std::int64_t>(i), {i % 2 == 0 ? "a" : "b"}));
  }
  EXPECT_TRUE(feed_.fell_behind(model_));
  feed_.Start(model_, Now());
  EXPECT_FALSE(feed_.fell_behind(model_));
}

// A frame of a forged ALARM is as long as 127 entries make it: 4,096 of them took 40 MB.
TEST_F(WebFeedTest, WhatWaitsForBrowsersIsBoundedInBytes) {
  std::vector<std::string> names;
  for (int i = 0; i < 25; ++i) names.push_back("a_long_name_of_an_alarm_" + std::to_string(i));
  for (int i = 0; i < 4'000; ++i) {
    std::vector<std::string> some(names.begin(), names.end() - i % 2);
    Hear("ALARM/axis1", AlarmMessage(i, some));
    ASSERT_LE(model_.event_bytes(), WebModel::kMaxEventBytes);
  }
  EXPECT_LT(model_.events_end() - model_.events_begin(), 4'000U);
}

// 600,000 names took 180 MB. The history for a new browser is bounded and contains the device of the file.
TEST_F(WebFeedTest, InventedDevicesBusesAndRecordersAreFew) {
  Hear("ALARM/axis1", AlarmMessage(1, {"battery_alarm"}));
  recorder_health_t recorder{};
  for (int i = 0; i < 2'000; ++i) {
    const std::string name = "x" + std::to_string(i);
    Hear("DEVICE/" + name, DeviceMessage(device_info_t::STATE_ONLINE));
    Hear("ALARM/" + name, AlarmMessage(1, {"forged"}));
    Hear("BUS/" + name, BusMessage(bus_health_t::STATE_UP));
    Hear("RECORDER/" + name, recorder);
    Hear("ALARM/recorder/" + name, AlarmMessage(1, {"forged"}));
  }
  const std::size_t devices = model_.monitor().machine().devices().size();
  EXPECT_EQ(devices, 1 + MachineView::kMaxUnlisted);
  EXPECT_EQ(model_.monitor().machine().buses().size(), 1 + MachineView::kMaxUnlisted);
  EXPECT_EQ(model_.Past(Now().utime).size(), devices + Monitor::kMaxRecorders) << "the alarms of each";
  EXPECT_THAT(model_.Past(Now().utime)[0], HasSubstr("battery_alarm"));
}

// A few strangers are shown beside the file's devices, with short curves: their rows took 1.4 MB each.
TEST_F(WebFeedTest, ADeviceThatTheFileDoesNotListHasFewRows) {
  Hear("DEVICE/stranger", DeviceMessage(device_info_t::STATE_ONLINE));
  for (std::size_t i = 0; i < 2 * WebModel::kUnlistedRows; ++i) {
    position_t position = PositionMessage(static_cast<std::int64_t>(i));
    position.utime = static_cast<std::int64_t>(i);
    Hear("POSITION/stranger", position);
  }
  const SampleHistory* rows = model_.samples(*model_.IndexOf("stranger"));
  ASSERT_NE(rows, nullptr);
  EXPECT_EQ(rows->end() - rows->begin(), WebModel::kUnlistedRows);
}

TEST_F(WebFeedTest, TellsSamplesOfSubscribedDevicesOnly) {
  HearReadings(10);
  EXPECT_THAT(Read("samples"), IsEmpty());
  EXPECT_TRUE(Subscribe());
  HearReadings(10);
  const std::vector<Json> frames = Read("samples");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0]["device"], "axis1");
  EXPECT_EQ(frames[0]["t0_utime"], kStart + 100'000);
  EXPECT_EQ(frames[0]["dt_us"][9], 90'000);
  EXPECT_THAT(Values(frames), ElementsAre(10, 11, 12, 13, 14, 15, 16, 17, 18, 19));
  EXPECT_EQ(frames[0]["columns"]["speed_rpm"][0], 60);
  EXPECT_EQ(frames[0]["dropped"], 0);
}

TEST_F(WebFeedTest, TellsThePastThatWasAskedFor) {
  HearReadings(5000);
  EXPECT_TRUE(Subscribe(20));
  const std::vector<Json> frames = Read("samples");
  const std::vector<int> values = Values(frames);
  ASSERT_EQ(values.size(), 2000U);
  EXPECT_EQ(values.front(), 3000);
  EXPECT_EQ(values.back(), 4999);
  EXPECT_EQ(frames.back()["dropped"], 0);
}

TEST_F(WebFeedTest, GivesASlowBrowserTheNewestSamplesAndCountsTheRest) {
  EXPECT_TRUE(Subscribe());
  HearReadings(1);
  EXPECT_THAT(Values(Read("samples")), ElementsAre(0));
  HearReadings(5000);
  const std::vector<Json> frames = Read("samples");
  const std::vector<int> values = Values(frames);
  ASSERT_EQ(values.size(), ClientStream::kMaxWaiting);
  EXPECT_EQ(values.back(), 5000);
  EXPECT_EQ(frames.back()["dropped"], 4000);
  HearReadings(10);
  EXPECT_EQ(Read("samples").back()["dropped"], 4000);
}

TEST_F(WebFeedTest, SendsOneDevicesSamplesAtMostTwentyTimesASecond) {
  EXPECT_TRUE(Subscribe());
  int frames = 0;
  for (int i = 0; i < 100; ++i) {
    HearReadings(1);
    frames += static_cast<int>(Read("samples").size());
  }
  EXPECT_LE(frames, 21);
  EXPECT_GE(frames, 19);
}

TEST_F(WebFeedTest, LeavesGapsWhereAReadingIsNotValid) {
  EXPECT_TRUE(Subscribe());
  position_t position = PositionMessage(0);
  position.flags = 0;
  Hear("POSITION/axis1", position);
  EXPECT_EQ(Read("samples").at(0)["columns"]["value"], Json::parse("[null]"));
}

TEST_F(WebFeedTest, RefusesADeviceThatThereIsNot) {
  const SubscribeRequest request = {.devices = {"axis1", "axis9"}};
  EXPECT_THAT(feed_.Subscribe(model_, request, Now()).error().text, HasSubstr("axis9"));
  HearReadings(1);
  EXPECT_EQ(Read("samples").size(), 1U);
}

TEST_F(WebFeedTest, AnEmptySubscriptionEndsSamples) {
  EXPECT_TRUE(Subscribe());
  HearReadings(5);
  EXPECT_EQ(Read("samples").size(), 1U);
  EXPECT_TRUE(feed_.Subscribe(model_, {}, Now()));
  HearReadings(100);
  EXPECT_THAT(Read("samples"), IsEmpty());
}

TEST_F(WebFeedTest, SaysHelloAgainWhenADeviceIsHeardForTheFirstTime) {
  Read();
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.device = "axis2";
  Hear("DEVICE/axis2", info);
  const std::vector<Json> frames = Read("hello");
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0]["devices"][1]["device"], "axis2");
  EXPECT_EQ(frames[0]["devices"][1]["unit"], "mm");
}

TEST_F(WebFeedTest, TellsErrorsAndForgetsThemWhereNobodyReads) {
  Read();
  for (int i = 0; i < 100'000; ++i) feed_.Queue(ErrorFrame("no"));
  const std::size_t errors = Read("error").size();
  EXPECT_THAT(errors, Gt(10U));
  EXPECT_LT(errors, 1000U);
}

}  // namespace
}  // namespace axlecast
