#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "drivers/runtime/bus/schedule.h"
#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"

// The schedule's promises under any stream of orders and any set of dead units, in virtual time.
namespace axlecast {
namespace {

constexpr MonoNs kStart = 1'000 * kSecond;
constexpr MonoNs kExchange = 136 * kMillisecond;
constexpr MonoNs kInVain = 250 * kMillisecond;

// A bus of units that the schedule gives its turns to. Each turn takes as long as it does on a slow bus.
class Line {
 public:
  explicit Line(std::size_t units, ScheduleSettings settings = Shared()) : schedule_(settings) {
    for (std::size_t i = 0; i < units; ++i) {
      devices_.push_back(std::make_unique<PolledDevice>(static_cast<std::uint8_t>(i), output_));
      schedule_.Add(*devices_.back());
    }
    dead_.assign(units, false);
    schedule_.Start(now_);
  }

  // As drivers/runtime/process sets up a bus with several devices.
  static ScheduleSettings Shared() {
    ScheduleSettings settings;
    settings.pause_most_shared = 2 * kSecond;
    settings.pause_costs = 32;
    return settings;
  }

  struct BusSlot {
    std::size_t unit = 0;
    int kind = 0;  // 0: nobody had a turn
  };
  // Carries out one step.
  BusSlot Run() {
    const Schedule::Choice choice = schedule_.Choose(now_);
    PolledDevice& device = *devices_[choice.device];
    const auto* exchange = std::get_if<Exchange>(&choice.step.action);
    if (exchange == nullptr) {
      if (const auto* silence = std::get_if<WaitForIdleLine>(&choice.step.action)) {
        now_ += silence->quiet;
        device.On({.kind = Event::Kind::kSilent, .sent = {}, .received = {}, .request = {}, .bytes = {}});
      } else {
        now_ = std::max(now_ + Schedule::kShortestIdle, std::min(choice.until, now_ + kSecond));
      }
      return {};
    }
    schedule_.Started(now_);
    device.OnStarted(choice.step, now_);
    const BusSlot turn{choice.device, exchange->request.data()[1]};
    Event event{.kind = Event::Kind::kTimeout, .sent = {now_, now_}, .received = {}, .request = {}, .bytes = {}};
    now_ += dead_[turn.unit] ? kInVain : kExchange;
    event.received = {now_, now_};
    const auto reply =
        PolledDevice::Reply(static_cast<std::uint8_t>(turn.unit), static_cast<std::uint8_t>(turn.kind), 1);
    if (!dead_[turn.unit]) {
      event.kind = Event::Kind::kReply;
      event.bytes = reply;
    }
    schedule_.Ended(turn.unit, event, now_);
    device.On(event);
    return turn;
  }

  void DriverCommand(std::size_t unit) {
    devices_[unit]->Begin({.id = {1}, .operation = "touch", .arguments = {}}, now_);
  }
  void Stop(std::size_t unit) { devices_[unit]->wants_stop = true; }
  [[nodiscard]] bool Stopping(std::size_t unit) const { return devices_[unit]->wants_stop; }
  void SetDead(std::size_t unit, bool dead) { dead_[unit] = dead; }
  [[nodiscard]] std::size_t size() const { return devices_.size(); }
  [[nodiscard]] MonoNs now() const { return now_; }

 private:
  RecordingOutput output_;
  Schedule schedule_;
  std::vector<std::unique_ptr<PolledDevice>> devices_;
  std::vector<bool> dead_;
  MonoNs now_ = kStart;
};

// Turns of orders between two readings of each unit.
class Gaps {
 public:
  explicit Gaps(std::size_t units) : orders_(units), longest_(units), readings_(units) {}

  void Count(const Line::BusSlot& turn) {
    if (turn.kind == PolledDevice::kTouch || turn.kind == PolledDevice::kStop) {
      for (std::size_t i = 0; i < orders_.size(); ++i) longest_[i] = std::max(longest_[i], ++orders_[i]);
    } else if (turn.kind == PolledDevice::kRead) {
      orders_[turn.unit] = 0;
      ++readings_[turn.unit];
    }
  }
  [[nodiscard]] std::size_t longest(std::size_t unit) const { return longest_[unit]; }
  [[nodiscard]] int readings(std::size_t unit) const { return readings_[unit]; }

 private:
  std::vector<std::size_t> orders_;
  std::vector<std::size_t> longest_;
  std::vector<int> readings_;
};

class ScheduleShare : public ::testing::Test {
 protected:
  std::size_t Up(std::size_t last) { return std::uniform_int_distribution<std::size_t>(0, last)(random_); }
  bool OneIn(std::size_t n) { return Up(n - 1) == 0; }

  std::mt19937 random_{17};  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same cases in each run
};

TEST_F(ScheduleShare, CommandsToOneUnitLeaveHalfOfTheTurnsToReadings) {
  for (std::size_t units = 1; units <= 16; ++units) {
    SCOPED_TRACE(units);
    Line line(units);
    Gaps gaps(units);
    const int turns = static_cast<int>(units) * 40;
    for (int i = 0; i < turns; ++i) {
      line.DriverCommand(0);
      gaps.Count(line.Run());
    }
    for (std::size_t i = 0; i < units; ++i) {
      EXPECT_LE(gaps.longest(i), units);
      EXPECT_GE(gaps.readings(i), 19);
    }
  }
}

TEST_F(ScheduleShare, AnyStreamOfCommandsLetsEveryUnitBeRead) {
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(run);
    Line line(1 + Up(15));
    Gaps gaps(line.size());
    const std::size_t rarity = 1 + Up(3);
    for (std::size_t i = 0; i < line.size(); ++i) line.SetDead(i, i > 0 && OneIn(4));
    for (int turn = 0; turn < 1'000; ++turn) {
      for (std::size_t i = 0; i < line.size(); ++i) {
        if (OneIn(rarity)) line.DriverCommand(i);
      }
      gaps.Count(line.Run());
    }
    // A dead unit that pauses is not due.
    EXPECT_LE(gaps.longest(0), line.size());
  }
}

TEST_F(ScheduleShare, AStopGoesNextWhateverTheStreamOfCommands) {
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(run);
    Line line(1 + Up(15));
    for (int stop = 0; stop < 20; ++stop) {
      for (std::size_t turn = 20 + Up(60); turn > 0; --turn) {
        for (std::size_t i = 0; i < line.size(); ++i) line.DriverCommand(i);
        static_cast<void>(line.Run());
      }
      // Each unit's own, all at once.
      for (std::size_t i = 0; i < line.size(); ++i) line.Stop(i);
      for (std::size_t i = 0; i < line.size(); ++i) EXPECT_EQ(line.Run().kind, PolledDevice::kStop);
    }
  }
}

TEST_F(ScheduleShare, StopsWithoutEndLetEveryUnitBeRead) {
  for (std::size_t units = 1; units <= 16; ++units) {
    SCOPED_TRACE(units);
    Line line(units);
    Gaps gaps(units);
    for (std::size_t turn = 0; turn < units * 100; ++turn) {
      for (std::size_t i = 0; i < units; ++i) {
        if (OneIn(2)) line.Stop(i);
        line.DriverCommand(i);
      }
      gaps.Count(line.Run());
    }
    for (std::size_t i = 0; i < units; ++i) {
      EXPECT_LE(gaps.longest(i), 4 * units);
      EXPECT_GT(gaps.readings(i), 10);
    }
  }
}

// An order that must not be interrupted, such as a reset that counts requests in a row, keeps its turns.
TEST_F(ScheduleShare, AnOrderThatMustNotBeInterruptedIsNot) {
  RecordingOutput output;
  PolledDevice device(1, output);
  device.leaves_reserved_turns = false;
  Schedule schedule({});
  schedule.Add(device);
  schedule.Start(kStart);
  device.Begin({.id = {1}, .operation = "touch", .arguments = {}}, kStart);
  for (int i = 0; i < 10; ++i) {
    const Schedule::Choice& choice = schedule.Choose(kStart);
    EXPECT_EQ(std::get<Exchange>(choice.step.action).request.data()[1], PolledDevice::kTouch);
    schedule.Started(kStart);
  }
}

TEST_F(ScheduleShare, SlowItemsKeepTheirShareUnderCommands) {
  RecordingOutput output;
  PolledDevice device(1, output);
  device.wants_slow = true;
  Schedule schedule({});
  schedule.Add(device);
  schedule.Start(kStart);
  int slow = 0;
  for (int i = 0; i < 128 * 20; ++i) {
    device.Begin({.id = {1}, .operation = "touch", .arguments = {}}, kStart);
    const Schedule::Choice& choice = schedule.Choose(kStart);
    slow += std::get<Exchange>(choice.step.action).request.data()[1] == PolledDevice::kSlowRead ? 1 : 0;
    schedule.Started(kStart);
  }
  EXPECT_EQ(slow, 20);
}

// Nobody is spared by a long pause when nobody answers.
TEST_F(ScheduleShare, AWholeBusThatComesBackIsReadWithinOneRound) {
  for (int run = 0; run < 50; ++run) {
    SCOPED_TRACE(run);
    Line line(1 + Up(15));
    const MonoNs until = line.now() + static_cast<MonoNs>(Up(10'000)) * kMillisecond;
    while (line.now() < until) static_cast<void>(line.Run());
    for (std::size_t i = 0; i < line.size(); ++i) line.SetDead(i, true);
    const MonoNs back = line.now() + static_cast<MonoNs>(Up(120'000)) * kMillisecond;
    while (line.now() < back) static_cast<void>(line.Run());
    for (std::size_t i = 0; i < line.size(); ++i) line.SetDead(i, false);
    std::vector<bool> read(line.size());
    const auto units = static_cast<MonoNs>(line.size());
    const MonoNs limit = line.now() + 100 * kMillisecond + 2 * units * kExchange;
    while (line.now() < limit) {
      const Line::BusSlot turn = line.Run();
      if (turn.kind == PolledDevice::kRead) read[turn.unit] = true;
    }
    EXPECT_EQ(std::count(read.begin(), read.end(), true), units);
  }
}

TEST_F(ScheduleShare, DeadUnitsCostTheOthersLittle) {
  for (std::size_t units = 2; units <= 16; ++units) {
    SCOPED_TRACE(units);
    Line line(units);
    for (std::size_t i = 1; i < units; ++i) line.SetDead(i, i == 1);
    const MonoNs warm = line.now() + 60 * kSecond;
    while (line.now() < warm) static_cast<void>(line.Run());
    const MonoNs begin = line.now();
    MonoNs used = 0;
    while (line.now() < begin + 1'000 * kSecond) {
      const Line::BusSlot turn = line.Run();
      if (turn.kind == PolledDevice::kRead && turn.unit != 1) used += kExchange;
    }
    EXPECT_GT(used, (line.now() - begin) * 95 / 100);
  }
}

}  // namespace
}  // namespace axlecast
