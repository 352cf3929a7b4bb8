#include "tools/replay/replay.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/command_t.hpp>

#include <array>
#include <axlecast/permit_t.hpp>
#include <axlecast/position_t.hpp>
#include "tools/log/log_event.h"
#include "tools/log/log_fixture.h"
#include "tools/replay/replay_fixture.h"

namespace axlecast {
namespace {

constexpr MonoNs kStart = 50'000 * kSecond;             // 14 hours of uptime
constexpr std::int64_t kUtime = 1'790'000'000'000'000;  // 2026

TEST(Timeline, IsExactFarFromItsAnchor) {
  Timeline timeline(1);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime), kStart);
  EXPECT_EQ(timeline.Due(kUtime + 1), kStart + kMicrosecond);
  EXPECT_EQ(timeline.Due(kUtime + 86'400'000'001), kStart + 86'400 * kSecond + kMicrosecond);
  EXPECT_EQ(timeline.Utime(kStart + 86'400 * kSecond), kUtime + 86'400'000'000);
}

TEST(Timeline, RunsAtItsSpeed) {
  Timeline timeline(4);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime + 8'000'000), kStart + 2 * kSecond);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime + 4'000'000);
  timeline.SetSpeed(0.5, kStart + kSecond);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime + 4'000'000);
  EXPECT_EQ(timeline.Due(kUtime + 5'000'000), kStart + 3 * kSecond);
}

TEST(Timeline, StandsWhilePaused) {
  Timeline timeline(1);
  timeline.Anchor(kStart, kUtime);
  timeline.Pause(kStart + kSecond);
  EXPECT_EQ(timeline.Due(kUtime), kNever);
  EXPECT_EQ(timeline.Utime(kStart + 9 * kSecond), kUtime + 1'000'000);
  timeline.Pause(kStart + 5 * kSecond);
  timeline.Resume(kStart + 10 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime + 2'000'000), kStart + 11 * kSecond);
  timeline.Resume(kStart + 20 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime + 2'000'000), kStart + 11 * kSecond);
}

TEST(Timeline, HasEverythingDueAtOnceAtSpeedZero) {
  Timeline timeline(0);
  timeline.Anchor(kStart, kUtime);
  EXPECT_EQ(timeline.Due(kUtime + 1'000'000'000), kStart);
  EXPECT_EQ(timeline.Utime(kStart + kSecond), kUtime);
}

TEST(Timeline, GoesOnWithoutAGapWhereTheRecordingsClockWasSet) {
  Timeline timeline(2);
  timeline.Anchor(kStart, kUtime);
  timeline.Splice(kUtime + 10'000'000, kUtime - 3'600'000'000);
  EXPECT_EQ(timeline.Due(kUtime - 3'600'000'000), kStart + 5 * kSecond);
  EXPECT_EQ(timeline.Due(kUtime - 3'598'000'000), kStart + 6 * kSecond);
}

TEST(Timeline, StaysWithinBoundsWhateverTheTimes) {
  Timeline timeline(0.001);
  timeline.Anchor(kStart, INT64_MIN / 8);
  EXPECT_GT(timeline.Due(INT64_MAX / 8), kStart);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
  timeline.Splice(INT64_MAX / 8, INT64_MIN / 8);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
  timeline.SetSpeed(1e6, kStart);
  EXPECT_LT(timeline.Due(INT64_MIN / 8), kNever);
  EXPECT_LT(timeline.Due(INT64_MAX / 8), kNever);
}

constexpr std::int64_t kS = 1'000'000;
constexpr std::int64_t kBegin = 1'790'000'000 * kS;

// Ten events, a second apart, "0" to "9"; before them the recorder's own, much later than they.
class ReplayRangeTest : public testing::Test {
 protected:
  ReplayRangeTest() {
    log_.Add(kBegin + 5 * kS, std::string(kMachineChannel), "machine: a");
    for (int i = 0; i < 10; ++i) log_.Add(kBegin + i * kS, std::to_string(i));
  }

  std::string Played(const ReplayRangeOptions& wish) {
    range_ = FindRange({log_.bytes()}, wish);
    LogMerge logs({log_.bytes()});
    logs.Go(range_.begin, range_.end);
    std::string channels;
    for (; logs.Head() != nullptr; logs.Advance()) {
      if (!IsLogChannel(logs.Head()->channel)) channels += logs.Head()->channel;
    }
    EXPECT_EQ(range_.empty, channels.empty());
    return channels;
  }

  RecordedLog log_;
  ReplayRange range_;
};

TEST_F(ReplayRangeTest, IsEverythingWithoutAWish) {
  EXPECT_EQ(Played({}), "0123456789");
  EXPECT_EQ(range_.begin_utime, kBegin);
  EXPECT_EQ(range_.end_utime, kBegin + 9 * kS);
}

TEST_F(ReplayRangeTest, IsByTime) {
  EXPECT_EQ(Played({.from = kBegin + 3 * kS, .until = kBegin + 6 * kS}), "345");
  EXPECT_EQ(range_.begin_utime, kBegin + 3 * kS);
  EXPECT_EQ(range_.end_utime, kBegin + 6 * kS);
  EXPECT_EQ(Played({.from = kBegin + 7 * kS}), "789");
  EXPECT_EQ(Played({.until = kBegin + 7 * kS}), "0123456");
  EXPECT_EQ(Played({.from = kBegin + 8 * kS - 1}), "89");
  EXPECT_EQ(Played({.from = kBegin + 8 * kS + 1}), "9");
}

// The bookkeeping event is number 0, as in every stock reader.
TEST_F(ReplayRangeTest, IsByNumber) {
  EXPECT_EQ(Played({.start_event = 3, .end_event = 5}), "23");
  EXPECT_EQ(range_.end_utime, kBegin + 4 * kS);
  EXPECT_EQ(Played({.start_event = 0, .end_event = 3}), "01");
  EXPECT_EQ(Played({.start_event = 9}), "89");
}

TEST_F(ReplayRangeTest, IsWhatBothTimeAndNumberAllow) {
  EXPECT_EQ(Played({.from = kBegin + 3 * kS, .start_event = 2, .end_event = 7}), "345");
}

TEST_F(ReplayRangeTest, IsEmptyWhereNothingFits) {
  EXPECT_EQ(Played({.from = kBegin + 100 * kS}), "");
  EXPECT_EQ(Played({.until = 0}), "");
  EXPECT_EQ(Played({.start_event = 5, .end_event = 5}), "");
  EXPECT_EQ(Played({.start_event = 7, .end_event = 5}), "");
  EXPECT_EQ(Played({.start_event = 1'000}), "");
  EXPECT_EQ(Played({.from = kBegin + 6 * kS, .until = kBegin + 3 * kS}), "");
  EXPECT_EQ(Played({.from = INT64_MAX, .until = INT64_MIN}), "");
  EXPECT_TRUE(FindRange({Bytes()}, {}).empty);
}

TEST_F(ReplayRangeTest, CountsOverSeveralLogs) {
  const RecordedLog other = RecordedLog().Add(kBegin + kS / 2, "a").Add(kBegin + kS * 5 / 2, "b");
  const std::vector<Bytes> both = {log_.bytes(), other.bytes()};
  const ReplayRange range = FindRange(both, {.start_event = 2, .end_event = 6});
  LogMerge logs(both);
  logs.Go(range.begin, range.end);
  std::string channels;
  for (; logs.Head() != nullptr; logs.Advance()) channels += logs.Head()->channel;
  EXPECT_EQ(channels, "a12b");
}

// Ten messages, a second apart, "0" to "9".
class ReplayTest : public testing::Test {
 protected:
  ReplayTest() {
    for (int i = 0; i < 10; ++i) log_.Add(kBegin + i * kS, std::to_string(i), "data " + std::to_string(i));
  }

  Replay& Start(const Replay::Options& options, const ReplayRangeOptions& wish = {}, ReplayChannels channels = {}) {
    const std::vector<Bytes> logs = {log_.bytes()};
    return replay_.emplace(logs, FindRange(logs, wish), std::move(channels), options, now_);
  }
  std::string PlayFor(MonoNs duration) { return Channels(PlayUntil(*replay_, now_, now_ + duration)); }
  std::string PlayRest() { return Channels(PlayToTheEnd(*replay_, now_)); }

  RecordedLog log_;
  MonoNs now_ = kStart;
  std::optional<Replay> replay_;
};

TEST_F(ReplayTest, PlaysEachMessageAtItsInstantWithItsContent) {
  Replay& replay = Start({});
  const std::vector<PlayedMessage> played = PlayToTheEnd(replay, now_);
  ASSERT_EQ(played.size(), 10);
  for (int i = 0; i < 10; ++i) {
    const MonoNs at = kStart + i * kSecond;
    EXPECT_EQ(played[static_cast<std::size_t>(i)],
              (PlayedMessage{std::to_string(i), "data " + std::to_string(i), at, at}));
  }
  EXPECT_TRUE(replay.AtEnd());
  EXPECT_EQ(replay.Due(), kNever);
  EXPECT_EQ(replay.Take(kNever - 1), std::nullopt);
  EXPECT_EQ(replay.counts().played, 10);
  EXPECT_EQ(replay.counts().bytes, 60);
  EXPECT_EQ(replay.counts().rounds, 1);
}

TEST_F(ReplayTest, GivesNothingBeforeItIsDue) {
  Replay& replay = Start({.speed = 2});
  EXPECT_TRUE(replay.Take(kStart));
  EXPECT_EQ(replay.Due(), kStart + kSecond / 2);
  EXPECT_FALSE(replay.Take(kStart + kSecond / 2 - 1));
  EXPECT_TRUE(replay.Take(kStart + kSecond / 2));
}

// A player that wakes up late each time is not later at the end than at the beginning.
TEST_F(ReplayTest, DoesNotDrift) {
  Replay& replay = Start({.speed = 3});
  MonoNs due = 0;
  while (!replay.AtEnd()) {
    now_ = std::max(now_, replay.Due() + 50 * kMillisecond);
    due = replay.Take(now_)->due;
  }
  EXPECT_EQ(due, kStart + 3 * kSecond);
}

TEST_F(ReplayTest, PlaysEverythingAtOnceAtSpeedZero) {
  Start({.speed = 0});
  EXPECT_EQ(PlayFor(0), "0123456789");
}

TEST_F(ReplayTest, PausesAndGoesOnWhereItWas) {
  Replay& replay = Start({});
  EXPECT_EQ(PlayFor(2 * kSecond + kMillisecond), "012");
  replay.Pause(now_);
  EXPECT_EQ(PlayFor(100 * kSecond), "");
  EXPECT_EQ(replay.Utime(now_), kBegin + 2'001'000);
  replay.Resume(now_);
  EXPECT_EQ(PlayFor(998 * kMillisecond), "");
  EXPECT_EQ(PlayFor(kMillisecond), "3");
}

TEST_F(ReplayTest, StepsOneMessageAtATime) {
  Replay& replay = Start({.paused = true});
  EXPECT_EQ(PlayFor(5 * kSecond), "");
  for (const char* expected : {"0", "1", "2"}) {
    replay.Step(now_);
    EXPECT_EQ(PlayFor(5 * kSecond), expected);
    EXPECT_TRUE(replay.paused());
  }
  EXPECT_EQ(replay.Utime(now_), kBegin + 2 * kS);
  replay.Resume(now_);
  EXPECT_EQ(PlayFor(kSecond), "3");
  replay.Step(now_);  // while it plays: the next one now, then it pauses
  EXPECT_EQ(PlayFor(5 * kSecond), "4");
}

TEST_F(ReplayTest, StepsOverWhatIsNotPlayed) {
  ReplayChannels channels;
  ASSERT_TRUE(channels.Select("[05]", false));
  Replay& replay = Start({.paused = true}, {}, channels);
  replay.Step(now_);
  EXPECT_EQ(PlayFor(0), "0");
  replay.Step(now_);
  EXPECT_EQ(PlayFor(0), "5");
  replay.Step(now_);
  EXPECT_EQ(PlayFor(0), "");
  EXPECT_TRUE(replay.AtEnd());
}

TEST_F(ReplayTest, ChangesItsSpeedOnTheWay) {
  Replay& replay = Start({});
  EXPECT_EQ(PlayFor(1'500 * kMillisecond), "01");
  replay.SetSpeed(10, now_);
  EXPECT_EQ(PlayFor(50 * kMillisecond), "2");
  EXPECT_EQ(PlayFor(99 * kMillisecond), "");
  EXPECT_EQ(PlayFor(kMillisecond), "3");
  replay.SetSpeed(0, now_);
  EXPECT_EQ(PlayFor(0), "456789");
}

TEST_F(ReplayTest, SeeksBothWaysPlayingAndPaused) {
  Replay& replay = Start({});
  EXPECT_EQ(PlayFor(2 * kSecond), "012");
  replay.Seek(replay.Utime(now_) + 4 * kS, now_);
  EXPECT_EQ(PlayFor(kSecond), "67");
  replay.Pause(now_);
  replay.Seek(kBegin + kS / 2, now_);
  EXPECT_EQ(PlayFor(kSecond), "");
  replay.Resume(now_);
  EXPECT_EQ(PlayFor(kSecond / 2), "1");
  replay.Seek(0, now_);
  EXPECT_EQ(PlayFor(kSecond), "01");
  replay.Seek(INT64_MAX, now_);
  EXPECT_EQ(PlayFor(kSecond), "9");
  EXPECT_TRUE(replay.AtEnd());
}

TEST_F(ReplayTest, SeeksWithinItsRangeOnly) {
  Replay& replay = Start({}, {.from = kBegin + 3 * kS, .until = kBegin + 6 * kS});
  replay.Seek(kBegin, now_);
  EXPECT_EQ(PlayFor(kSecond), "34");
  replay.Seek(kBegin + 9 * kS, now_);
  EXPECT_EQ(PlayFor(10 * kSecond), "");
  EXPECT_TRUE(replay.AtEnd());
}

TEST_F(ReplayTest, LoopsWithTheRangesLengthAsItsPeriod) {
  Replay& replay = Start({.loop = true}, {.from = kBegin + 7 * kS, .until = kBegin + 10 * kS});
  const std::vector<PlayedMessage> played = PlayUntil(replay, now_, kStart + 3 * 1'000 * kSecond - 1);
  ASSERT_EQ(played.size(), 3'000);
  EXPECT_EQ(Channels(played).substr(0, 7), "7897897");
  for (std::size_t i = 0; i < played.size(); ++i) {
    ASSERT_EQ(played[i].due, kStart + static_cast<MonoNs>(i) * kSecond);
  }
  EXPECT_EQ(replay.counts().rounds, 1'000);
}

TEST_F(ReplayTest, DoesNotSpinInALoopOfOneMessageNorOfNone) {
  Start({.loop = true}, {.end_event = 1});
  EXPECT_LE(PlayFor(kSecond).size(), 1'001);
  ReplayChannels channels;
  ASSERT_TRUE(channels.Select("none", false));
  Replay& silent = Start({.speed = 0, .loop = true}, {}, channels);
  EXPECT_EQ(PlayFor(kSecond), "");
  EXPECT_TRUE(silent.AtEnd());
  EXPECT_EQ(silent.counts().not_selected, 10);
}

TEST_F(ReplayTest, GoesOnWithoutAGapOrABurstWhereTheRecordersClockWasSet) {
  log_.Add(kBegin - 3'600 * kS, "a").Add(kBegin - 3'599 * kS, "b").Add(kBegin - 3'598 * kS, "c");
  Start({});
  EXPECT_EQ(PlayFor(7 * kSecond), "01234567");
  EXPECT_EQ(PlayFor(4 * kSecond), "89abc");
}

TEST_F(ReplayTest, PlaysAtOnceWhatIsALittleOlderThanTheOneBefore) {
  log_.Add(kBegin + 11 * kS, "a").Add(kBegin + 11 * kS - 300'000, "b").Add(kBegin + 12 * kS, "c");
  Start({});
  EXPECT_EQ(PlayFor(11 * kSecond), "0123456789ab");
  EXPECT_EQ(PlayFor(kSecond), "c");
}

TEST_F(ReplayTest, MovesWhatFollowsWhenItWasHeldUp) {
  Replay& replay = Start({});
  EXPECT_TRUE(replay.Take(now_));
  now_ += 5 * kSecond;  // "1" to "5" should have come
  EXPECT_EQ(PlayFor(0), "1");
  EXPECT_EQ(PlayFor(kSecond), "2");
  EXPECT_EQ(replay.counts().held_up, 1);
}

TEST_F(ReplayTest, CatchesUpWhenItWasALittleLate) {
  Replay& replay = Start({.speed = 10});
  EXPECT_TRUE(replay.Take(now_));
  now_ += 500 * kMillisecond;
  EXPECT_EQ(PlayFor(0), "12345");
  EXPECT_EQ(replay.counts().held_up, 0);
}

std::string Encoded(const command_t& command) {
  std::string data(static_cast<std::size_t>(command.getEncodedSize()), '\0');
  EXPECT_EQ(command.encode(data.data(), 0, static_cast<int>(data.size())), static_cast<int>(data.size()));
  return data;
}

TEST_F(ReplayTest, HoldsCommandsAndPermitsBack) {
  log_.Add(kBegin, "COMMAND", "anything").Add(kBegin, "PERMIT/axis1").Add(kBegin, "ROBOT_COMMAND", "not ours");
  log_.Add(kBegin, "cell1/COMMAND", Encoded({}));
  Replay& replay = Start({.speed = 0});
  EXPECT_EQ(PlayFor(0), "0123456789ROBOT_COMMAND");
  EXPECT_EQ(replay.counts().held_back, 3);
  Start({.speed = 0, .allow_commands = true});
  EXPECT_EQ(PlayFor(0), "0123456789COMMANDPERMIT/axis1ROBOT_COMMANDcell1/COMMAND");
}

TEST_F(ReplayTest, DoesNotPlayTheLogsBookkeeping) {
  log_.Add(kBegin + 10 * kS, std::string(kSchemaChannel), "package axlecast;").Add(kBegin + 11 * kS, "a");
  Replay& replay = Start({});
  EXPECT_EQ(PlayRest(), "0123456789a");
  EXPECT_EQ(replay.counts().not_selected, 1);
}

TEST_F(ReplayTest, PassesOverDamageAndTellsOfIt) {
  log_.AddDamage(20).Add(kBegin + 11 * kS, "a").AddDamage(5);
  Replay& replay = Start({.speed = 0});
  EXPECT_EQ(PlayFor(0), "0123456789a");
  EXPECT_EQ(replay.damage(), (LogMerge::DamageCount{2, 25}));
}

// No single call takes long, however much lies between two messages that are played.
TEST_F(ReplayTest, ComesUpForAirInALongStretchOfOtherChannels) {
  for (int i = 0; i < 250'000; ++i) log_.Add(kBegin + 10 * kS, "other");
  log_.Add(kBegin + 10 * kS, "a");
  ReplayChannels channels;
  ASSERT_TRUE(channels.Select("^[0-9a]$", false));
  Replay& replay = Start({.speed = 0}, {}, channels);
  int empty = 0;
  std::string last;
  while (!replay.AtEnd()) {
    const auto message = replay.Take(now_);
    if (message) {
      last = *message->channel;
    } else {
      ++empty;
    }
  }
  EXPECT_EQ(last, "a");
  EXPECT_GE(empty, 2);
  EXPECT_EQ(replay.counts().not_selected, 250'000);
}

TEST(CommandChannel, IsKnownByItsName) {
  for (const char* name : {"COMMAND", "COMMAND_STATUS", "PERMIT/axis1", "PERMIT/", "DRIVER_COMMAND/rs485-0",
                           "DRIVER_STATUS/rs485-0"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kPlain) << name;
  }
  for (const char* name :
       {"cell1/COMMAND", "m_COMMAND_STATUS", "xPERMIT/axis1", "ROBOT_COMMAND", "a/DRIVER_COMMAND/b"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kAfterPrefix) << name;
  }
  for (const char* name :
       {"POSITION/axis1", "COMMANDS", "PERMIT", "COMMAND/axis1", "DRIVER_STATUS", "", "command"}) {
    EXPECT_EQ(CommandChannelOf(name), CommandChannel::kNone) << name;
  }
}

template <typename Type>
bool IsCommand(const Type& message) {
  std::array<std::uint8_t, 1'400> buffer;
  const int size = message.encode(buffer.data(), 0, static_cast<int>(buffer.size()));
  return IsCommandMessage(Bytes(buffer.data(), static_cast<std::size_t>(size)));
}

TEST(CommandMessage, IsKnownByItsType) {
  EXPECT_TRUE(IsCommand(command_t{}));
  EXPECT_TRUE(IsCommand(permit_t{}));
  EXPECT_FALSE(IsCommand(position_t{}));
  EXPECT_FALSE(IsCommandMessage({}));
}

using testing::HasSubstr;

TEST(ReplayChannels, PlayAllButTheLogsBookkeepingUnderTheirNames) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Of("POSITION/axis1").selected);
  EXPECT_EQ(channels.Of("POSITION/axis1").name, "POSITION/axis1");
  EXPECT_TRUE(channels.Of("").selected);
  EXPECT_FALSE(channels.Of(kSchemaChannel).selected);
  EXPECT_FALSE(channels.Of(kMachineChannel).selected);
}

TEST(ReplayChannels, PlayThoseInWhichTheExpressionIsFound) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Select("^POSITION/|axis2$", false));
  EXPECT_TRUE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis2").selected);
  EXPECT_FALSE(channels.Of("ALARM/axis1").selected);
}

TEST(ReplayChannels, PlayTheOthersWhenInverted) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Select("^POSITION/", true));
  EXPECT_FALSE(channels.Of("POSITION/axis1").selected);
  EXPECT_TRUE(channels.Of("ALARM/axis1").selected);
  EXPECT_FALSE(channels.Of(kRecorderChannel).selected);
}

TEST(ReplayChannels, AreRenamedOneRuleAfterTheOtherThenPrefixed) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Rename("axis([0-9])=joint$1"));
  EXPECT_TRUE(channels.Rename("^POSITION/joint1$=A=B"));
  channels.Prefix("old/");
  EXPECT_EQ(channels.Of("POSITION/axis1").name, "old/A=B");
  EXPECT_EQ(channels.Of("POSITION/axis2").name, "old/POSITION/joint2");
}

TEST(ReplayChannels, AreJudgedByTheNameUnderWhichTheyArePublished) {
  ReplayChannels channels;
  EXPECT_TRUE(channels.Rename("^COMMAND$=ASKED"));
  EXPECT_TRUE(channels.Rename("^POSITION/.*=COMMAND"));
  EXPECT_EQ(channels.Of("COMMAND").command, CommandChannel::kNone);
  EXPECT_EQ(channels.Of("POSITION/axis1").command, CommandChannel::kPlain);
  EXPECT_EQ(channels.Of("COMMAND_STATUS").command, CommandChannel::kPlain);
}

TEST(ReplayChannels, SayWhatIsWrongWithAnExpression) {
  ReplayChannels channels;
  EXPECT_THAT(channels.Select("(POSITION", false).error().text,
              HasSubstr("'(POSITION' is no regular expression ("));
  EXPECT_THAT(channels.Rename("[=x").error().text, HasSubstr("'[' is no regular expression ("));
  EXPECT_THAT(channels.Rename("axis1").error().text, HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Rename("=x").error().text, HasSubstr("is not OLD=NEW"));
  EXPECT_THAT(channels.Select(std::string(100'000, '('), false).error().text, HasSubstr("at most 1000 characters"));
}

}  // namespace

}  // namespace axlecast
