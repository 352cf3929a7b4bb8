#include "tools/web/log_player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools/log/log_fixture.h"
#include "tools/log/log_merge.h"
#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::DoubleNear;

constexpr std::int64_t kLogStart = 1'790'000'000'000'000;
constexpr MonoNs kNow = 1000 * kSecond;

// 200 s of a machine: a reading every 100 ms, whose value is its time in seconds, and its DEVICE each second.
class LogPlayerTest : public ::testing::Test {
 protected:
  LogPlayerTest() {
    for (int i = 0; i <= 2000; ++i) {
      position_t position = PositionMessage(i);
      position.utime = kLogStart + i * 100'000;
      position.value = i / 10.0;
      Add(position.utime, "POSITION/axis1", position);
      if (i % 10 == 0) Add(position.utime, "DEVICE/axis1", DeviceMessage(device_info_t::STATE_ONLINE));
    }
    logs_ = {log_.bytes()};
    const LogSpan span = SpanOf(logs_);
    facts_ = {.files = {"run.lcm"}, .first_utime = span.first, .last_utime = span.last};
    player_ = std::make_unique<LogPlayer>(logs_, machine_, "1", facts_, now_);
  }

  template <typename Message>
  void Add(std::int64_t utime, const std::string& channel, const Message& message) {
    const std::vector<std::uint8_t> bytes = Encoded(message);
    log_.Add(utime, channel, {bytes.begin(), bytes.end()});
  }
  void Settle() {
    for (int i = 0; i < 1000 && !player_->Advance(now_); ++i) {
    }
    EXPECT_FALSE(player_->Playback(now_).seeking);
  }
  void Pass(double seconds) {
    const MonoNs end = now_ + static_cast<MonoNs>(seconds * 1e9);
    for (; now_ < end; now_ += 50 * kMillisecond) static_cast<void>(player_->Advance(now_));
  }
  [[nodiscard]] double Value() { return player_->model().monitor().machine().devices()[0].position->value; }
  [[nodiscard]] double At() const { return static_cast<double>(player_->Playback(now_).utime - kLogStart) / 1e6; }

  RecordedLog log_;
  std::vector<Bytes> logs_;
  WebLogFacts facts_;
  MachineConfig machine_ = OneAxis();
  MonoNs now_ = kNow;
  std::unique_ptr<LogPlayer> player_;
};

TEST_F(LogPlayerTest, StandsWhereEverythingHasBeenToldOnce) {
  EXPECT_TRUE(player_->Playback(now_).seeking);
  Settle();
  EXPECT_THAT(At(), DoubleNear(2.5, 0.2));
  EXPECT_TRUE(player_->model().monitor().machine().devices()[0].Online(player_->Now(now_).mono));
  Pass(10);
  EXPECT_THAT(At(), DoubleNear(2.5, 0.2));
  EXPECT_FALSE(player_->Playback(now_).playing);
}

TEST_F(LogPlayerTest, PlaysAtItsSpeed) {
  Settle();
  player_->Play(true, now_);
  Pass(10);
  EXPECT_THAT(At(), DoubleNear(12.5, 0.3));
  EXPECT_THAT(Value(), DoubleNear(12.5, 0.3));
  player_->SetSpeed(4, now_);
  Pass(10);
  EXPECT_THAT(Value(), DoubleNear(52.5, 0.8));
  player_->Play(false, now_);
  const double value = Value();
  Pass(10);
  EXPECT_EQ(Value(), value);
}

TEST_F(LogPlayerTest, SeeksBothWaysAndKnowsThePastOfThePlace) {
  Settle();
  for (const double place : {150.0, 30.0, 90.0}) {
    player_->Seek(kLogStart + static_cast<std::int64_t>(place * 1e6), now_);
    Settle();
    EXPECT_THAT(At(), DoubleNear(place, 0.2));
    EXPECT_THAT(Value(), DoubleNear(place, 0.2));
    const SampleHistory& history = *player_->model().samples(0);
    const double past = static_cast<double>(player_->Now(now_).utime - history.utime(history.begin())) / 1e6;
    EXPECT_THAT(past, DoubleNear(std::min(place, 75.0), 0.5));
  }
}

TEST_F(LogPlayerTest, GoesOnPlayingBehindASeek) {
  Settle();
  player_->Play(true, now_);
  player_->Seek(kLogStart + 100'000'000, now_);
  Settle();
  Pass(5);
  EXPECT_THAT(Value(), DoubleNear(105, 0.3));
}

TEST_F(LogPlayerTest, EndsAndBeginsAgain) {
  Settle();
  player_->Seek(INT64_MAX, now_);
  Settle();
  player_->Play(true, now_);
  EXPECT_TRUE(player_->Playback(now_).seeking);  // it was at the end
  Settle();
  EXPECT_THAT(At(), DoubleNear(0, 0.2));
  player_->SetSpeed(100, now_);
  Pass(5);
  EXPECT_TRUE(player_->Playback(now_).at_end);
  EXPECT_FALSE(player_->Playback(now_).playing);
  EXPECT_EQ(Value(), 200);
}

TEST_F(LogPlayerTest, TakesNoMoreInOneStepThanTheOthersCanWaitFor) {
  for (int i = 0; i < 2 * LogPlayer::kMaxPerAdvance; ++i)
    Add(kLogStart + 200'000'000, "POSITION/axis1", PositionMessage(i));
  logs_ = {log_.bytes()};
  LogPlayer player(logs_, machine_, "1", facts_, now_);
  player.Seek(INT64_MAX, now_);
  const SequenceCount& readings = player.model().monitor().machine().devices()[0].readings;
  EXPECT_FALSE(player.Advance(now_));
  EXPECT_LE(readings.received(), LogPlayer::kMaxPerAdvance);
  int steps = 1;
  while (!player.Advance(now_)) ++steps;
  EXPECT_EQ(steps, 2);
}

}  // namespace
}  // namespace axlecast
