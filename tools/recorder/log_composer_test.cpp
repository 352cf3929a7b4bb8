#include "tools/recorder/log_composer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_t.hpp>
#include <string>
#include <utility>

#include <axlecast/alarm_t.hpp>
#include <vector>
#include "core/messages/message.h"
#include "tools/log/log_event.h"
#include "tools/recorder/recorder_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kUtime = 1'700'000'000'000'000;

class RecorderTest : public ::testing::Test {
 protected:
  void Start(RecorderSettings settings = {}) {
    recorder_.emplace(std::move(settings), logs_);
    recorder_->Start(now_, Utime());
  }
  void StartSplit(std::uint64_t bytes, MonoNs time) {
    RecorderSettings settings;
    settings.split_bytes = bytes;
    settings.split_time = time;
    Start(std::move(settings));
  }
  void On(std::string_view channel, std::string_view text) {
    recorder_->On(MessageOf(channel, text, Utime()), now_);
  }
  void Pass(MonoNs time) {
    now_ += time;
    recorder_->Poll(now_, Utime());
  }
  void End() { recorder_->End(Utime()); }
  [[nodiscard]] std::int64_t Utime() const { return kUtime + now_ / kMicrosecond; }
  [[nodiscard]] std::vector<std::string> In(std::size_t log) const { return MessagesIn(logs_.logs.at(log).bytes); }
  [[nodiscard]] std::vector<std::string> ChannelsIn(std::size_t log) const {
    std::vector<std::string> channels;
    LogReader reader(logs_.logs.at(log).bytes);
    while (const auto event = reader.Next()) channels.emplace_back(event->channel);
    return channels;
  }

  MemoryLogs logs_;
  std::optional<LogComposer> recorder_;
  MonoNs now_ = kSecond;
};

TEST_F(RecorderTest, WritesWhatComesBehindTheHeader) {
  RecorderSettings settings;
  settings.identity.machine = "machine: press3\n";
  Start(std::move(settings));
  On("A", "1");
  On("B", "");
  On("A", "1");
  End();
  ASSERT_THAT(logs_.logs, SizeIs(1));
  EXPECT_TRUE(logs_.logs[0].ended);
  EXPECT_THAT(In(0), ElementsAre("A=1", "B=", "A=1"));
  EXPECT_THAT(ChannelsIn(0),
              ElementsAre(kRecorderChannel, kMachineChannel, kSchemaChannel, "A", "B", "A", kSealChannel));
  EXPECT_EQ(recorder_->messages(), 3);
  EXPECT_EQ(recorder_->bytes(), static_cast<std::int64_t>(logs_.logs[0].bytes.size()));
}

TEST_F(RecorderTest, TheHeaderHoldsEveryDefinitionAndWhoRecorded) {
  RecorderSettings settings;
  settings.identity.name = "press3";
  settings.identity.host = "h\xff";
  settings.identity.urls = {"udpm://239.255.76.67:7667"};
  Start(std::move(settings));
  LogReader reader(logs_.logs[0].bytes);
  const auto about = reader.Next();
  const std::string json(about->data.begin(), about->data.end());
  EXPECT_THAT(json, HasSubstr("\"name\":\"press3\""));
  EXPECT_THAT(json, HasSubstr("\"file_number\":0"));
  EXPECT_THAT(json, HasSubstr("udpm://239.255.76.67:7667"));
  const auto schema = reader.Next();
  ASSERT_EQ(schema->channel, kSchemaChannel) << "no machine's file, no event of it";
  const std::string text(schema->data.begin(), schema->data.end());
  for (const char* type : {"struct alarm_t", "struct position_t", "struct wire_record_t", "// wire_t.lcm\n"}) {
    EXPECT_THAT(text, HasSubstr(type));
  }
}

TEST_F(RecorderTest, SealsEachSecondWhereSomethingCame) {
  Start();
  On("A", "1");
  Pass(LogComposer::kSealInterval - 1);
  EXPECT_THAT(ChannelsIn(0), SizeIs(3));
  Pass(1);
  EXPECT_THAT(ChannelsIn(0), SizeIs(4));
  Pass(10 * kSecond);
  EXPECT_THAT(ChannelsIn(0), SizeIs(4)) << "silence needs no seal";
  On("A", "2");
  End();
  EXPECT_THAT(ChannelsIn(0), SizeIs(6));
  EXPECT_THAT(In(0), ElementsAre("A=1", "A=2"));
}

TEST_F(RecorderTest, NoLogGrowsBeyondItsSize) {
  constexpr std::uint64_t kSize = 100'000;
  StartSplit(kSize, 0);
  const std::string kilobyte(1'000, 'x');
  for (int i = 0; i < 300; ++i) On("A", kilobyte + std::to_string(i));
  End();
  ASSERT_GT(logs_.logs.size(), 3U);
  std::vector<std::string> all;
  for (std::size_t i = 0; i < logs_.logs.size(); ++i) {
    EXPECT_LE(logs_.logs[i].bytes.size(), kSize);
    EXPECT_EQ(ChannelsIn(i)[0], kRecorderChannel);
    for (const std::string& message : In(i)) all.push_back(message);
  }
  ASSERT_THAT(all, SizeIs(300));
  for (int i = 0; i < 300; ++i) EXPECT_EQ(all[static_cast<std::size_t>(i)], "A=" + kilobyte + std::to_string(i));
}

TEST_F(RecorderTest, AMessageLargerThanTheLimitHasALogOfItsOwn) {
  StartSplit(50'000, 0);
  On("A", std::string(200'000, 'x'));
  On("B", std::string(200'000, 'x'));
  End();
  EXPECT_THAT(logs_.logs, SizeIs(2));
}

TEST_F(RecorderTest, SplitsByTimeWhenTheNextMessageComes) {
  StartSplit(0, 60 * kSecond);
  On("A", "1");
  Pass(600 * kSecond);
  EXPECT_THAT(logs_.logs, SizeIs(1)) << "no log without messages";
  On("A", "2");
  EXPECT_THAT(logs_.logs, SizeIs(2));
  EXPECT_EQ(logs_.logs[1].utime, Utime());
  EXPECT_THAT(In(1), ElementsAre("A=2"));
}

TEST_F(RecorderTest, GoesOnWithALogThatWasTorn) {
  Start();
  On("A", "1");
  Pass(kSecond);
  On("A", "2");  // not sealed
  std::vector<std::uint8_t> log = logs_.logs[0].bytes;
  const std::size_t whole = log.size();
  log.insert(log.end(), {0xed, 0xa1, 0xda, 0x01, 0, 0});
  const LogTail tail = FindTail(log);
  EXPECT_EQ(tail.size, whole);
  EXPECT_EQ(tail.torn, 6U);
  EXPECT_EQ(tail.open.seal().events, 1U);

  MemoryLogs more;
  LogComposer again({}, more);
  again.Continue(tail, now_, Utime());
  again.On(MessageOf("A", "3", Utime()), now_);
  again.End(Utime());
  log.resize(whole);
  log.insert(log.end(), more.logs[0].bytes.begin(), more.logs[0].bytes.end());
  EXPECT_THAT(MessagesIn(log), ElementsAre("A=1", "A=2", "A=3"));
}

TEST_F(RecorderTest, NumbersItsLogsInTheirHeaders) {
  StartSplit(0, kSecond);
  for (int i = 0; i < 3; ++i) {
    On("A", "1");
    Pass(kSecond);
  }
  ASSERT_THAT(logs_.logs, SizeIs(3));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_THAT(std::string(AsText(logs_.logs[i].bytes)), HasSubstr("\"file_number\":" + std::to_string(i)));
  }
}

TEST_F(RecorderTest, ALogIsSplitAtItsMaximumAgeNotBefore) {
  StartSplit(0, 60 * kSecond);
  for (std::size_t log = 1; log < 4; ++log) {
    On("A", "1");
    Pass(60 * kSecond - 1);
    On("A", "2");
    EXPECT_THAT(logs_.logs, SizeIs(log));
    Pass(1);
    On("A", "3");
    EXPECT_THAT(logs_.logs, SizeIs(log + 1)) << "its age counts from its own begin";
  }
}

TEST_F(RecorderTest, ALogOfExactlyTheMaximumSizeIsNotSplit) {
  const auto logs_with = [this](std::uint64_t split_bytes) {
    logs_.logs.clear();
    StartSplit(split_bytes, 0);
    for (const char* text : {"1", "22", "333"}) On("A", text);
    End();
    return logs_.logs.size();
  };
  ASSERT_EQ(logs_with(0), 1U);
  const std::uint64_t whole = logs_.logs[0].bytes.size();
  EXPECT_EQ(logs_with(whole), 1U) << "with its last seal";
  EXPECT_EQ(logs_with(whole - 1), 2U);
}

TEST_F(RecorderTest, TheSmallestLimitsGiveEachMessageALogOfItsOwn) {
  StartSplit(1, 0);
  for (int i = 0; i < 3; ++i) On("A", "1");
  EXPECT_THAT(logs_.logs, SizeIs(3));
  End();
  logs_.logs.clear();
  StartSplit(0, 1);
  for (int i = 0; i < 3; ++i) {
    On("A", "1");
    Pass(1);
  }
  EXPECT_THAT(logs_.logs, SizeIs(3));
}

TEST_F(RecorderTest, ASealIsDueOneSecondAfterTheBeginAndTheLastOne) {
  Start();
  EXPECT_EQ(recorder_->next_poll(), now_ + kSecond);
  Pass(kSecond + 5);
  EXPECT_EQ(recorder_->next_poll(), now_ + kSecond);
  End();
  EXPECT_EQ(recorder_->next_poll(), kNever);
  EXPECT_FALSE(recorder_->recording());
}

TEST_F(RecorderTest, ARecordingThatEndedIsNotEndedAgain) {
  Start();
  On("A", "1");
  End();
  const std::int64_t bytes = recorder_->bytes();
  End();
  EXPECT_EQ(recorder_->bytes(), bytes);
}

TEST_F(RecorderTest, CountsTheLossesOfItsChannels) {
  Start();
  for (const std::int64_t seq : {1, 5}) {
    position_t message{};
    message.boot_id = 1;
    message.seq = seq;
    recorder_->On({.utime = Utime(), .channel = "POSITION/axis1", .data = Encoded(message)}, now_);
  }
  const auto losses = recorder_->channels().losses();
  ASSERT_THAT(losses, SizeIs(1));
  EXPECT_EQ(losses[0].lost, 3);
}

class PreTriggerTest : public RecorderTest {
 protected:
  void Wait(std::size_t memory = 1 << 20) {
    RecorderSettings settings;
    settings.pre_trigger = PreTrigger{std::regex("^ESTOP"), 10 * kSecond, 5 * kSecond, memory};
    Start(std::move(settings));
  }
};

TEST_F(PreTriggerTest, RecordsWhatCameBeforeAndAfter) {
  Wait();
  On("A", "too old");
  Pass(1);
  On("A", "1");
  Pass(10 * kSecond);
  EXPECT_THAT(logs_.logs, IsEmpty());
  EXPECT_FALSE(recorder_->recording());
  On("ESTOP", "!");
  EXPECT_TRUE(recorder_->recording());
  On("A", "2");
  Pass(5 * kSecond);
  EXPECT_FALSE(recorder_->recording());
  On("A", "3");
  ASSERT_THAT(logs_.logs, SizeIs(1));
  EXPECT_TRUE(logs_.logs[0].ended);
  EXPECT_THAT(In(0), ElementsAre("A=1", "ESTOP=!", "A=2"));
  EXPECT_EQ(recorder_->messages(), 3);
}

TEST_F(PreTriggerTest, EveryTriggerProlongsTheRecording) {
  Wait();
  On("ESTOP", "1");
  Pass(4 * kSecond);
  On("ESTOP", "2");
  Pass(4 * kSecond);
  On("A", "1");
  EXPECT_THAT(logs_.logs, SizeIs(1));
  Pass(kSecond);
  On("A", "2");
  Pass(kSecond);
  On("ESTOP", "3");
  EXPECT_THAT(logs_.logs, SizeIs(2));
  End();
  EXPECT_THAT(In(0), ElementsAre("ESTOP=1", "ESTOP=2", "A=1"));
  EXPECT_THAT(In(1), ElementsAre("A=2", "ESTOP=3"));
}

TEST_F(PreTriggerTest, TheMemoryIsBoundedAndSaysSo) {
  Wait(10'000);
  for (int i = 0; i < 100; ++i) On("A", std::string(1'000, 'x'));
  EXPECT_GT(recorder_->early(), 80);
  On("ESTOP", "!");
  End();
  EXPECT_LT(In(0).size(), 20U);
}

TEST_F(PreTriggerTest, WithoutATriggerThereIsNoLog) {
  Wait();
  On("A", "1");
  End();
  EXPECT_THAT(logs_.logs, IsEmpty());
}

TEST_F(PreTriggerTest, ARecordingIsDueAtItsEnd) {
  Wait();
  EXPECT_EQ(recorder_->next_poll(), kNever);
  On("ESTOP", "!");
  const MonoNs end = now_ + 5 * kSecond;
  while (now_ + kSecond < end) {
    EXPECT_EQ(recorder_->next_poll(), now_ + kSecond) << "a seal";
    Pass(kSecond);
  }
  EXPECT_EQ(recorder_->next_poll(), end);
  Pass(kSecond - 1);
  EXPECT_TRUE(recorder_->recording());
  Pass(1);
  EXPECT_FALSE(recorder_->recording());
  EXPECT_EQ(recorder_->next_poll(), kNever);
}

TEST_F(PreTriggerTest, ALogThatWasEndedIsNotEndedWhenItsTimeIsOver) {
  Wait();
  On("ESTOP", "!");
  End();
  Pass(5 * kSecond);
  EXPECT_THAT(logs_.logs, SizeIs(1));
}

TEST_F(PreTriggerTest, ALogBeginsWithTheTimeOfItsFirstMessage) {
  Wait();
  On("A", "1");
  const std::int64_t first = Utime();
  Pass(3 * kSecond);
  On("ESTOP", "!");
  Pass(5 * kSecond);
  Pass(20 * kSecond);
  On("ESTOP", "!");
  ASSERT_THAT(logs_.logs, SizeIs(2));
  EXPECT_EQ(logs_.logs[0].utime, first);
  EXPECT_EQ(logs_.logs[1].utime, Utime()) << "nothing was before it";
}

TEST_F(PreTriggerTest, EachRecordingBeginsANewLogWithoutMessages) {
  RecorderSettings settings;
  settings.pre_trigger = PreTrigger{std::regex("^ESTOP"), 10 * kSecond, 5 * kSecond, 1 << 20};
  settings.split_bytes = 1'000;
  Start(std::move(settings));
  for (std::size_t log = 1; log < 3; ++log) {
    On("ESTOP", std::string(2'000, 'x'));
    EXPECT_THAT(logs_.logs, SizeIs(log));
    Pass(5 * kSecond);
  }
}

TEST_F(PreTriggerTest, WithoutAPreTriggerNothingIsRemovedEarly) {
  Start();
  On("A", "1");
  EXPECT_EQ(recorder_->early(), 0);
}

// The smallest memory in which the ring keeps these messages.
std::size_t MemoryFor(const std::vector<LogEvent>& messages) {
  for (std::size_t limit = 0; limit < 100'000; ++limit) {
    MessageRing ring(kSecond, limit);
    for (const LogEvent& message : messages) ring.Add(message, 0);
    if (ring.early() == 0) return limit;
  }
  return 0;
}

TEST(MessageRing, AMessageTakesTheMemoryOfItsChannelItsDataAndItsPlace) {
  const std::size_t smallest = MemoryFor({MessageOf("", "", 0)});
  EXPECT_GE(smallest, 100U);
  EXPECT_LE(smallest, 200U);
  EXPECT_EQ(MemoryFor({MessageOf("A", "", 0)}), smallest + 1);
  EXPECT_EQ(MemoryFor({MessageOf("ABC", "12345", 0)}), smallest + 8);
  EXPECT_EQ(MemoryFor({MessageOf("ABC", "12345", 0), MessageOf("A", "", 0)}), 2 * smallest + 9);
}

TEST(MessageRing, WhatIsTakenOrTooOldOrRemovedEarlyTakesNoMemory) {
  const LogEvent message = MessageOf("A", "12345", 7);
  MessageRing ring(kSecond, MemoryFor({message, message, message}));
  for (int i = 0; i < 3; ++i) ring.Add(message, 0);
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(ring.Take());
  for (int i = 0; i < 2; ++i) ring.Add(message, 0);
  EXPECT_EQ(ring.early(), 0) << "two were taken";
  for (int i = 0; i < 3; ++i) ring.Add(message, kSecond + 1);
  EXPECT_EQ(ring.early(), 0) << "three were too old";
  for (int i = 0; i < 3; ++i) ring.Add(message, kSecond + 1);
  EXPECT_EQ(ring.early(), 3);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(ring.Take());
  EXPECT_FALSE(ring.Take());
}

TEST(MessageRing, KeepsMessagesForItsSpanAndGivesThemAsTheyCame) {
  MessageRing ring(kSecond, 1 << 20);
  ring.Add(MessageOf("A", "old", 1), 0);
  ring.Add(MessageOf("B", "kept", 2), 1);
  ring.Expire(kSecond);
  ring.Expire(kSecond + 1);
  const auto kept = ring.Take();
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->utime, 2);
  EXPECT_EQ(kept->channel, "B");
  EXPECT_EQ(AsText(kept->data), "kept");
  EXPECT_FALSE(ring.Take());
}

TEST(MessageRing, AMessageLargerThanTheMemoryIsRemovedItself) {
  MessageRing ring(kSecond, 500);
  ring.Add(MessageOf("A", std::string(1'000, 'x'), 0), 0);
  EXPECT_EQ(ring.early(), 1);
  EXPECT_FALSE(ring.Take());
}

template <typename Message>
void On(ChannelLosses& losses, const char* channel, std::int64_t seq, std::int64_t boot_id = 1) {
  Message message{};
  message.boot_id = boot_id;
  message.seq = seq;
  std::vector<std::uint8_t> data(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(data.data(), 0, static_cast<int>(data.size()));
  losses.On({.channel = channel, .data = data});
}

TEST(ChannelLosses, CountsTheGapsOfEachChannel) {
  ChannelLosses losses;
  for (const std::int64_t seq : {5, 6, 9}) On<position_t>(losses, "POSITION/axis1", seq);
  for (const std::int64_t seq : {1, 7}) On<position_t>(losses, "POSITION/axis2", seq);
  On<position_t>(losses, "POSITION/axis2", 100, 2);
  for (const std::int64_t seq : {1, 2}) On<position_t>(losses, "POSITION/axis3", seq);
  const auto found = losses.losses();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].channel, "POSITION/axis2");
  EXPECT_EQ(found[0].lost, 5);
  EXPECT_EQ(found[0].received, 3);
  EXPECT_EQ(found[1].channel, "POSITION/axis1");
  EXPECT_EQ(found[1].lost, 2);
}

TEST(ChannelLosses, CountsThoseThatCameFirstHoweverManyChannelsAreInvented) {
  ChannelLosses losses;
  On<position_t>(losses, "POSITION/axis1", 0);
  for (int i = 0; i < 10'000; ++i) {
    const std::string channel = "POSITION/x" + std::to_string(i);
    for (const std::int64_t seq : {0, 2}) On<position_t>(losses, channel.c_str(), seq);
  }
  On<position_t>(losses, "POSITION/axis1", 9);
  const auto found = losses.losses();
  EXPECT_EQ(found.size(), ChannelLosses::kMaxChannels);
  EXPECT_EQ(found[0].channel, "POSITION/axis1");
  EXPECT_EQ(found[0].lost, 8);
}

TEST(ChannelLosses, EqualLossesAreInTheOrderOfTheirChannels) {
  ChannelLosses losses;
  for (const char* channel : {"C", "B", "D", "A"}) {
    for (const std::int64_t seq : {1, 3}) On<position_t>(losses, channel, seq);
  }
  std::vector<std::string> channels;
  for (const ChannelLoss& loss : losses.losses()) channels.push_back(loss.channel);
  EXPECT_THAT(channels, ElementsAre("A", "B", "C", "D"));
}

TEST(ChannelLosses, PassesOverWhatHasNoNumbers) {
  ChannelLosses losses;
  // Each client counts these by itself.
  for (const std::int64_t seq : {1, 9}) {
    On<command_t>(losses, "COMMAND", seq);
    On<permit_t>(losses, "PERMIT", seq);
    On<driver_command_t>(losses, "DRIVER_COMMAND", seq);
  }
  losses.On({.channel = "X", .data = {}});
  const std::vector<std::uint8_t> text(100, 'x');
  losses.On({.channel = "X", .data = text});
  EXPECT_TRUE(losses.losses().empty());
}

constexpr std::int64_t kBegin = 1'700'000'000'000'000;

class TriggerWatchTest : public ::testing::Test {
 protected:
  // An ALARM message that holds these, each of `state`.
  bool OnAlarms(const std::string& channel, const std::vector<std::string>& names,
                std::int8_t state = alarm_entry_t::STATE_LIVE, int total = 0,
                std::int64_t first_utime = kBegin - 1) {
    alarm_t alarms{};
    alarms.n = static_cast<std::int8_t>(names.size());
    alarms.total = static_cast<std::int16_t>(total == 0 ? alarms.n : total);
    for (const std::string& name : names) {
      alarm_entry_t& entry = alarms.entries.emplace_back();
      entry.state = state;
      entry.first_utime = first_utime;
      entry.name = name;
    }
    std::vector<std::uint8_t> data(static_cast<std::size_t>(alarms.getEncodedSize()));
    alarms.encode(data.data(), 0, static_cast<int>(data.size()));
    return watch_.Fires({.channel = channel, .data = data});
  }

  TriggerWatch watch_{std::regex("^ALARM/axis1 battery|^ESTOP$"), kBegin};
};

TEST_F(TriggerWatchTest, AnAlarmFiresWhenItAppears) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"over_speed"}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"over_speed", "battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"over_speed", "battery_error"})) << "repeated each second";
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"})) << "again";
}

TEST_F(TriggerWatchTest, OnlyTheAlarmsThatAreMeant) {
  EXPECT_FALSE(OnAlarms("ALARM/axis2", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis2", {"battery_error"}));
}

TEST_F(TriggerWatchTest, AnAlarmThatStandsAtTheBeginningDoesNot) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, AnAlarmThatAppearsBeforeTheFirstMessageIsHeardFires) {
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
}

TEST_F(TriggerWatchTest, AnAlarmThatIsGoneOrUnknownIsNone) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNACKNOWLEDGED));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_DEVICE_LATCHED));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNKNOWN));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"})) << "back online, it was there all the time";
}

TEST_F(TriggerWatchTest, AnAlarmThatEndedWithoutBeingAcknowledgedFiresAgain) {
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_DRIVER_LATCHED, 0, kBegin));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNACKNOWLEDGED));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, AnUnknownAlarmThatWasNotPresentDoesNotFire) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}, alarm_entry_t::STATE_UNKNOWN));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, TwoAlarmsOfAMessageFire) {
  EXPECT_TRUE(
      OnAlarms("ALARM/axis1", {"battery_error", "other", "battery_low"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
}

TEST_F(TriggerWatchTest, ANameOfTwentyFourBytesIsTheLongest) {
  const std::string longest = "battery" + std::string(17, 'x');
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {longest}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {longest + 'x'}, alarm_entry_t::STATE_LIVE, 0, kBegin));
}

class TriggerWatchMemoryTest : public TriggerWatchTest {
 protected:
  static std::vector<std::string> Names(int count) {
    std::vector<std::string> names;
    for (int i = 0; i < count; ++i) names.push_back("name" + std::to_string(i));
    return names;
  }
};

TEST_F(TriggerWatchMemoryTest, AlarmsThatFoundNoRoomAreRememberedUpToSixtyFour) {
  EXPECT_EQ(watch_.remembered(), 0U);
  OnAlarms("ALARM/axis1", Names(63));
  EXPECT_EQ(watch_.remembered(), 63U);
  OnAlarms("ALARM/axis1", {"worse"}, alarm_entry_t::STATE_LIVE, 64);
  EXPECT_EQ(watch_.remembered(), 64U);
  OnAlarms("ALARM/axis2", Names(64));
  OnAlarms("ALARM/axis2", {"worse"}, alarm_entry_t::STATE_LIVE, 65);
  EXPECT_EQ(watch_.remembered(), 65U) << "of axis2 only the worse one";
  OnAlarms("ALARM/axis2", Names(64), alarm_entry_t::STATE_LIVE, 65);
  EXPECT_EQ(watch_.remembered(), 128U);
}

TEST_F(TriggerWatchMemoryTest, AMessageThatNamesAllAlarmsEndsTheOthers) {
  OnAlarms("ALARM/axis1", Names(3));
  OnAlarms("ALARM/axis1", Names(2));
  EXPECT_EQ(watch_.remembered(), 2U);
}

TEST_F(TriggerWatchMemoryTest, AThousandChannelsAreWatched) {
  watch_ = TriggerWatch(std::regex("battery"), kBegin);
  for (int i = 0; i < 1'000; ++i) {
    EXPECT_TRUE(OnAlarms("ALARM/x" + std::to_string(i), {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  }
  EXPECT_FALSE(OnAlarms("ALARM/y", {"battery_error"}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_EQ(watch_.remembered(), 1'000U);
  EXPECT_FALSE(OnAlarms("ALARM/x0", {}));
  EXPECT_TRUE(OnAlarms("ALARM/x0", {"battery_error"})) << "it is known";
}

TEST_F(TriggerWatchTest, AnAlarmThatFoundNoRoomInAMessageMayStandStill) {
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {}));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"worse"}, alarm_entry_t::STATE_LIVE, 2));
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

TEST_F(TriggerWatchTest, ANameOfAnyLengthIsStood) {
  watch_ = TriggerWatch(std::regex("ALARM/.* battery"), kBegin);
  EXPECT_FALSE(OnAlarms("ALARM/axis1", {std::string(3'000'000, 'x')}, alarm_entry_t::STATE_LIVE, 0, kBegin));
  EXPECT_TRUE(OnAlarms("ALARM/axis1", {"battery_error"}));
}

// 10,000 channels of 1,000 alarms each could be remembered: about 1 GB.
TEST_F(TriggerWatchTest, RemembersNoMoreWhateverChannelsAndAlarmsCome) {
  for (int channel = 0; channel < 1'500; ++channel) {
    std::vector<std::string> names;
    for (int i = 0; i < 120; ++i) names.push_back(std::to_string(i));
    EXPECT_FALSE(OnAlarms("ALARM/x" + std::to_string(channel), names));
  }
  EXPECT_LE(watch_.remembered(), 64'000U);
}

TEST_F(TriggerWatchTest, OtherMessagesFireByTheirChannel) {
  EXPECT_TRUE(watch_.Fires(MessageOf("ESTOP", "x", 0)));
  EXPECT_TRUE(watch_.Fires(MessageOf("ESTOP", "x", 0)));
  EXPECT_FALSE(watch_.Fires(MessageOf("ESTOP2", "x", 0)));
}

}  // namespace

}  // namespace axlecast
