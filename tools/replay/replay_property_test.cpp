// Whatever sequence of pauses, steps, speeds and seeks: order and content are those of the logs.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <tuple>

#include "tools/replay/replay_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kBegin = 1'790'000'000'000'000;
constexpr std::int64_t kLength = 2'000'000;  // us
constexpr int kEvents = 500;

struct Truth {
  std::int64_t utime;
  std::string data;
};

// Three logs with equal times among them, and what the merged sequence of them must be.
class World {
 public:
  explicit World(std::uint32_t seed) : random_(seed) {
    std::vector<std::tuple<std::int64_t, std::size_t, std::string>> all;
    for (std::size_t log = 0; log < logs_.size(); ++log) {
      std::vector<std::int64_t> times(kEvents);
      for (std::int64_t& time : times) time = kBegin + Any(kLength / 100) * 100;
      std::sort(times.begin(), times.end());
      for (const std::int64_t time : times) {
        const std::string data = std::to_string(log) + ':' + std::to_string(all.size());
        logs_[log].Add(time, "c", data);
        all.emplace_back(time, log, data);
      }
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& one, const auto& other) {
      return std::tie(std::get<0>(one), std::get<1>(one)) < std::tie(std::get<0>(other), std::get<1>(other));
    });
    for (const auto& [time, log, data] : all) truth_.push_back({time, data});
  }

  std::int64_t Any(std::int64_t below) {
    return std::uniform_int_distribution<std::int64_t>(0, below - 1)(random_);
  }
  [[nodiscard]] std::vector<Bytes> logs() const { return {logs_[0].bytes(), logs_[1].bytes(), logs_[2].bytes()}; }
  [[nodiscard]] const std::vector<Truth>& truth() const { return truth_; }
  [[nodiscard]] std::size_t FirstNotBefore(std::int64_t utime) const {
    return static_cast<std::size_t>(
        std::lower_bound(truth_.begin(), truth_.end(), utime,
                         [](const Truth& event, std::int64_t time) { return event.utime < time; }) -
        truth_.begin());
  }

 private:
  std::mt19937 random_;
  std::array<RecordedLog, 3> logs_;
  std::vector<Truth> truth_;
};

class ReplayPropertyTest : public testing::TestWithParam<std::uint32_t> {};

TEST_P(ReplayPropertyTest, KeepsOrderAndContent) {
  World world(GetParam());
  MonoNs now = 70'000 * kSecond;
  Replay replay(world.logs(), FindRange(world.logs(), {}), {}, {}, now);
  std::size_t next = 0;  // what must come
  std::size_t played = 0;
  for (int i = 0; i < 3'000 && !replay.AtEnd(); ++i) {
    bool stepped = false;
    switch (world.Any(8)) {
      case 0:
        replay.Pause(now);
        break;
      case 1:
        replay.Resume(now);
        break;
      case 2:
        replay.Step(now);
        stepped = true;
        break;
      case 3:
        replay.SetSpeed(std::array{0.5, 1.0, 3.0, 17.0}[static_cast<std::size_t>(world.Any(4))], now);
        break;
      case 4: {
        const std::int64_t to = std::max(world.truth().front().utime, kBegin + world.Any(kLength) * 9 / 10);
        replay.Seek(to, now);
        next = world.FirstNotBefore(to);
        break;
      }
      default:
        break;
    }
    const bool paused = replay.paused();
    const std::int64_t from = replay.Utime(now);
    const MonoNs begin = now;
    const auto messages = PlayUntil(replay, now, now + world.Any(3) * kMillisecond);
    for (const PlayedMessage& message : messages) {
      ASSERT_LT(next, world.truth().size());
      ASSERT_EQ(message.data, world.truth()[next].data);
      // Within 1 us of where the recording's time lies on the clock, unless it was overdue.
      if (!paused) {
        const double us = static_cast<double>(world.truth()[next].utime - from) / replay.speed();
        ASSERT_NEAR(static_cast<double>(message.due - begin), us * 1e3, 2e3);
      }
      ++next;
      ++played;
    }
    if (paused) {
      ASSERT_EQ(messages.size(), stepped ? 1 : 0);
    }
  }
  replay.SetSpeed(0, now);
  replay.Resume(now);
  for (const PlayedMessage& message : PlayToTheEnd(replay, now)) {
    ASSERT_EQ(message.data, world.truth()[next++].data);
    ++played;
  }
  EXPECT_EQ(next, world.truth().size());
  EXPECT_EQ(replay.counts().played, static_cast<std::int64_t>(played));
}

INSTANTIATE_TEST_SUITE_P(Seeds, ReplayPropertyTest, testing::Range(0U, 30U));

}  // namespace
}  // namespace axlecast
