#include "drivers/runtime/bus/schedule.h"

#include <gmock/gmock.h>

#include <map>
#include <memory>
#include <vector>

#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"

namespace axlecast {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

constexpr MonoNs kStart = 1'000 * kSecond;

class ScheduleTest : public ::testing::Test {
 protected:
  void Make(int devices, ScheduleSettings settings = {}) {
    schedule_ = std::make_unique<Schedule>(settings);
    for (int i = 0; i < devices; ++i) {
      devices_.push_back(std::make_unique<PolledDevice>(static_cast<std::uint8_t>(i), output_));
      schedule_->Add(*devices_.back());
    }
    schedule_->Start(kStart);
  }

  // Carries out the next choice, if it is to transmit: address and kind of its request.
  std::vector<int> RunOne(MonoNs now) {
    const Schedule::Choice& choice = schedule_->Choose(now);
    const auto* exchange = std::get_if<Exchange>(&choice.step.action);
    if (exchange == nullptr) return {};
    schedule_->Started(now);
    return {exchange->request.data()[0], exchange->request.data()[1]};
  }

  RecordingOutput output_;
  std::vector<std::unique_ptr<PolledDevice>> devices_;
  std::unique_ptr<Schedule> schedule_;
};

TEST_F(ScheduleTest, LiveReadingsGoRound) {
  Make(3);
  std::vector<int> addresses;
  for (int i = 0; i < 7; ++i) addresses.push_back(RunOne(kStart)[0]);
  EXPECT_THAT(addresses, ElementsAre(0, 1, 2, 0, 1, 2, 0));
}

TEST_F(ScheduleTest, SilenceThenStopThenCommandThenLiveThenSlow) {
  Make(5);
  devices_[0]->wants_slow = true;
  devices_[0]->idle_until = 0;
  devices_[1]->Begin({.id = {1}, .operation = "touch", .arguments = {}}, kStart);
  devices_[2]->wants_stop = true;
  devices_[3]->On({.kind = Event::Kind::kTimeout, .sent = {}, .received = {}, .request = {}, .bytes = {}});

  const Schedule::Choice& silence = schedule_->Choose(kStart);
  EXPECT_EQ(silence.device, 3U);
  EXPECT_TRUE(std::holds_alternative<WaitForIdleLine>(silence.step.action));
  devices_[3]->On({.kind = Event::Kind::kSilent, .sent = {}, .received = {}, .request = {}, .bytes = {}});

  EXPECT_THAT(RunOne(kStart), ElementsAre(2, PolledDevice::kStop));
  devices_[2]->wants_stop = false;
  EXPECT_THAT(RunOne(kStart), ElementsAre(1, PolledDevice::kTouch));
  EXPECT_TRUE(devices_[1]->Cancel({1}, kStart));
  EXPECT_THAT(RunOne(kStart)[1], PolledDevice::kRead);
}

TEST_F(ScheduleTest, SlowItemsFillTheGapsBetweenSlots) {
  Make(1, {.period = kMillisecond});
  devices_[0]->wants_slow = true;
  EXPECT_THAT(RunOne(kStart), ElementsAre(0, PolledDevice::kRead));
  EXPECT_THAT(RunOne(kStart + 100), ElementsAre(0, PolledDevice::kSlowRead));
  EXPECT_THAT(RunOne(kStart + kMillisecond), ElementsAre(0, PolledDevice::kRead));
}

TEST_F(ScheduleTest, SlowItemsHaveTheirShareOfABusThatIsAlwaysBusy) {
  Make(2);
  devices_[1]->wants_slow = true;
  int slow = 0;
  for (int i = 0; i < 128 * 20; ++i) slow += RunOne(kStart + i)[1] == PolledDevice::kSlowRead ? 1 : 0;
  EXPECT_EQ(slow, 20);
  devices_[1]->wants_slow = false;
  std::vector<int> kinds;
  for (int i = 0; i < 500; ++i) kinds.push_back(RunOne(kStart + kSecond + i)[1]);
  EXPECT_THAT(kinds, Each(PolledDevice::kRead));  // an unused share costs nothing
}

TEST_F(ScheduleTest, WaitsForTheNextSlot) {
  Make(2, {.period = kMillisecond, .phase = 300 * kMicrosecond});
  const Schedule::Choice& idle = schedule_->Choose(kStart);
  ASSERT_TRUE(std::holds_alternative<Idle>(idle.step.action));
  EXPECT_EQ(idle.until, kStart + 300 * kMicrosecond);
  EXPECT_FALSE(RunOne(kStart + 300 * kMicrosecond).empty());
  EXPECT_FALSE(RunOne(kStart + 300 * kMicrosecond).empty());
  EXPECT_TRUE(RunOne(kStart + 300 * kMicrosecond).empty());
  EXPECT_EQ(schedule_->Choose(kStart + 301 * kMicrosecond).until, kStart + 1'300 * kMicrosecond);
}

TEST_F(ScheduleTest, AnIdleDeviceIsAskedWhenItSaid) {
  Make(1);
  devices_[0]->idle_until = kStart + 7 * kMillisecond;
  EXPECT_EQ(schedule_->Choose(kStart).until, kStart + 7 * kMillisecond);
  EXPECT_FALSE(RunOne(kStart + 7 * kMillisecond).empty());
}

// A device whose wish lies in the past must not make an idle bus spin.
TEST_F(ScheduleTest, IdleNeverEndsAtOnce) {
  class Hasty final : public Device {
   public:
    [[nodiscard]] Step Next(const BusSlot& turn) const override { return {.action = Idle{turn.now}}; }
    void OnStarted(const Step&, MonoNs) override {}
    void On(const Event&) override {}
    [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override { return {}; }
    void Begin(const DriverCommand&, MonoNs) override {}
    [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return true; }
  } hasty;
  Schedule schedule({});
  schedule.Add(hasty);
  schedule.Start(kStart);
  EXPECT_EQ(schedule.Choose(kStart).until, kStart + Schedule::kShortestIdle);
}

TEST_F(ScheduleTest, MissedSlotsAreLateButDeclinedOnesAreNot) {
  Make(1, {.period = kMillisecond});
  EXPECT_FALSE(RunOne(kStart).empty());
  EXPECT_FALSE(RunOne(kStart + 4 * kMillisecond).empty());  // slots 1 to 3
  EXPECT_EQ(schedule_->late(), 3);
  devices_[0]->idle_until = kStart + 20 * kMillisecond;  // slots 5 to 19
  EXPECT_TRUE(RunOne(kStart + 5 * kMillisecond).empty());
  EXPECT_FALSE(RunOne(kStart + 20 * kMillisecond).empty());
  EXPECT_EQ(schedule_->late(), 3);
}

class BackOffTest : public ScheduleTest {
 protected:
  void TimeOut(std::size_t device, MonoNs now, Bytes bytes = {}) {
    schedule_->Ended(
        device, {.kind = Event::Kind::kTimeout, .sent = {}, .received = {now, now}, .request = {}, .bytes = bytes},
        now);
  }
};

TEST_F(BackOffTest, ASilentDevicesLiveSlotsThinOutUpToALimit) {
  Make(1, {.silent_after = 3, .pause_first = kMillisecond, .pause_most = 100 * kMillisecond});
  TimeOut(0, kStart);
  TimeOut(0, kStart);
  EXPECT_FALSE(RunOne(kStart).empty());
  MonoNs now = kStart;
  std::vector<MonoNs> pauses;
  for (int i = 0; i < 9; ++i) {
    TimeOut(0, now);
    const MonoNs until = schedule_->Choose(now).until;
    pauses.push_back((until - now) / kMillisecond);
    EXPECT_TRUE(RunOne(until - 1).empty());
    EXPECT_FALSE(RunOne(until).empty());
    now = until;
  }
  EXPECT_THAT(pauses, ElementsAre(1, 2, 4, 8, 16, 32, 64, 100, 100));
  EXPECT_EQ(schedule_->late(), 0);
}

TEST_F(BackOffTest, SlotsThatAreThinnedOutAreNotLate) {
  Make(1, {.period = kMillisecond, .silent_after = 1});
  int asked = 0;
  for (MonoNs now = kStart; now < kStart + kSecond; now += kMillisecond) {
    if (RunOne(now).empty()) continue;
    ++asked;
    TimeOut(0, now + 500 * kMicrosecond);
  }
  EXPECT_LT(asked, 20);
  EXPECT_EQ(schedule_->late(), 0);
}

TEST_F(BackOffTest, OneAnswerEndsIt) {
  Make(1, {.silent_after = 1});
  TimeOut(0, kStart);
  EXPECT_TRUE(RunOne(kStart).empty());
  schedule_->Ended(0, {.kind = Event::Kind::kReply, .sent = {}, .received = {}, .request = {}, .bytes = {}},
                   kStart);
  TimeOut(0, kStart + kSecond);
  EXPECT_EQ(schedule_->Choose(kStart + kSecond).until, kStart + kSecond + kMillisecond);  // from the beginning
}

TEST_F(BackOffTest, ADeviceThatSendsSomethingIsNotSilent) {
  Make(1, {.silent_after = 1});
  const std::uint8_t byte = 1;
  for (int i = 0; i < 20; ++i) TimeOut(0, kStart, Bytes(&byte, 1));
  EXPECT_FALSE(RunOne(kStart).empty());
}

TEST_F(BackOffTest, CommandsGoToASilentDeviceAtOnce) {
  Make(1, {.silent_after = 1});
  TimeOut(0, kStart);
  devices_[0]->Begin({.id = {1}, .operation = "touch", .arguments = {}}, kStart);
  EXPECT_THAT(RunOne(kStart), ElementsAre(0, PolledDevice::kTouch));
}

TEST_F(BackOffTest, ASilentDeviceLeavesItsTurnsToTheOthers) {
  Make(4, {.silent_after = 2, .pause_first = 10 * kMillisecond, .pause_most_shared = kSecond});
  std::map<int, int> turns;
  MonoNs now = kStart;
  for (int i = 0; i < 4'000; ++i, now += kMillisecond) {
    const int address = RunOne(now)[0];
    ++turns[address];
    if (address == 2) TimeOut(2, now);
  }
  EXPECT_LT(turns[2], 15);
  EXPECT_NEAR(turns[0], turns[1], 2);
  EXPECT_NEAR(turns[0], turns[3], 2);
}

}  // namespace
}  // namespace axlecast
