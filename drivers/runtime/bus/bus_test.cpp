#include "drivers/runtime/bus/bus.h"

#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/support/polled_device.h"
#include "tests/support/recording_output.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr MonoNs kStart = 1'000 * kSecond;

class LinkLog final : public LinkObserver {
 public:
  void OnLink(bool up, std::string_view reason, MonoNs) override {
    lines.push_back(up ? "up" : "down: " + std::string(reason));
  }
  std::vector<std::string> lines;
};

class BusTest : public ::testing::Test {
 protected:
  void Make(int devices, BusSettings settings = {}) {
    bus_ = std::make_unique<Bus>(settings, link_, clock_, observer_, nullptr);
    for (int i = 0; i < devices; ++i) {
      devices_.push_back(std::make_unique<PolledDevice>(static_cast<std::uint8_t>(i), output_));
      bus_->Add(*devices_.back());
    }
  }
  void RunUntil(MonoNs until) {
    while (clock_.Now() < until) bus_->RunOnce(until);
  }
  [[nodiscard]] static BusSettings Every(MonoNs period) {
    BusSettings settings;
    settings.schedule.period = period;
    return settings;
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_, PolledDevices()};
  LinkLog observer_;
  RecordingOutput output_;
  std::vector<std::unique_ptr<PolledDevice>> devices_;
  std::unique_ptr<Bus> bus_;
};

TEST_F(BusTest, ReadsInAbsoluteSlots) {
  Make(1, Every(kMillisecond));
  RunUntil(kStart + 100 * kMillisecond);
  ASSERT_EQ(link_.write_times().size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(link_.write_times()[i], kStart + static_cast<MonoNs>(i) * kMillisecond);
    EXPECT_EQ(output_.samples[i].counts, static_cast<std::int64_t>(i));
    EXPECT_EQ(output_.samples[i].at.last - output_.samples[i].at.first, 100 * kMicrosecond);
  }
  EXPECT_EQ(bus_->late(), 0);
  EXPECT_EQ(bus_->counters().exchanges, 100);
  EXPECT_EQ(bus_->stats().Percentile(0.5), 100 * kMicrosecond);
}

TEST_F(BusTest, WithoutPeriodReadsAsFastAsTheBusAllows) {
  Make(1);
  RunUntil(kStart + 100 * kMillisecond);
  EXPECT_EQ(link_.write_times().size(), 1'000U);
  EXPECT_EQ(link_.waits(), 0);
}

TEST_F(BusTest, AnIdleBusSleepsUntilItsNextSlot) {
  Make(1, Every(10 * kMillisecond));
  RunUntil(kStart + kSecond);
  EXPECT_EQ(output_.samples.size(), 100U);
  EXPECT_LE(link_.waits(), 101);
}

TEST_F(BusTest, AWakeEndsTheSleepAndACommandGoesAtOnce) {
  Make(1, Every(kSecond));
  RunUntil(kStart + 10 * kMillisecond);
  link_.WakeAt(kStart + 20 * kMillisecond);
  bus_->RunOnce(kStart + 100 * kMillisecond);
  EXPECT_EQ(clock_.Now(), kStart + 20 * kMillisecond);
  devices_[0]->Begin({.id = {1}, .operation = "touch", .arguments = {}}, clock_.Now());
  bus_->RunOnce(kStart + 100 * kMillisecond);
  EXPECT_EQ(link_.write_times().back(), kStart + 20 * kMillisecond);
  EXPECT_EQ(devices_[0]->started.back(), PolledDevice::kTouch);
}

TEST_F(BusTest, NeverTransmitsOverStrayBytes) {
  Make(1);
  RunUntil(kStart + kMillisecond);
  const std::size_t before = link_.written().size();
  link_.ArriveAt(clock_.Now(), {1, 2, 3});
  devices_[0]->told.clear();
  devices_[0]->started.clear();
  bus_->RunOnce(kNever);
  EXPECT_EQ(link_.written().size(), before);
  EXPECT_THAT(devices_[0]->told, ElementsAre(Event::Kind::kUnexpectedBytes));
  EXPECT_THAT(devices_[0]->started, IsEmpty());
  bus_->RunOnce(kNever);  // the silence that the device asks for
  EXPECT_EQ(devices_[0]->told.back(), Event::Kind::kSilent);
  bus_->RunOnce(kNever);
  EXPECT_EQ(link_.written().size(), before + 1);
  EXPECT_EQ(link_.write_times().back() - link_.write_times()[before - 1],
            100 * kMicrosecond + PolledDevice::kQuiet);
}

TEST_F(BusTest, OneThatDoesNotWaitGoesOutBetweenBytesAndBeforeTheSilenceOfOthers) {
  Make(2);
  RunUntil(kStart + kMillisecond);
  const MonoNs babble = clock_.Now();
  for (MonoNs at = 0; at < kSecond; at += 100 * kMicrosecond) link_.ArriveAt(babble + at, {0x55});
  const std::size_t before = link_.written().size();
  RunUntil(babble + 100 * kMillisecond);
  ASSERT_EQ(link_.written().size(), before) << "nothing else is transmitted";
  devices_[0]->stops_regardless = true;
  devices_[0]->wants_stop = true;
  devices_[1]->told.clear();
  const MonoNs wanted = clock_.Now();
  link_.ArriveAt(wanted, {0x66});
  bus_->RunOnce(kNever);
  ASSERT_EQ(link_.written().size(), before + 1);
  EXPECT_EQ(link_.written().back()[1], PolledDevice::kStop);
  EXPECT_EQ(link_.write_times().back(), wanted);
  EXPECT_THAT(devices_[1]->told, Contains(Event::Kind::kUnexpectedBytes))
      << "what came before is told all the same";
}

TEST_F(BusTest, StrayBytesAreToldToAllButAnOutcomeOnlyToItsDevice) {
  Make(2, Every(kSecond));
  bus_->RunOnce(kNever);
  bus_->RunOnce(kNever);
  bus_->RunOnce(kNever);
  EXPECT_THAT(devices_[0]->told, ElementsAre(Event::Kind::kLinkUp, Event::Kind::kReply));
  EXPECT_THAT(devices_[1]->told, ElementsAre(Event::Kind::kLinkUp, Event::Kind::kReply));
  link_.ArriveAt(clock_.Now() + kMillisecond, {9});
  bus_->RunOnce(kNever);
  EXPECT_EQ(devices_[0]->told.back(), Event::Kind::kUnexpectedBytes);
  EXPECT_EQ(devices_[1]->told.back(), Event::Kind::kUnexpectedBytes);
}

TEST_F(BusTest, ABabblingLineKeepsTheBusSilentButAlive) {
  Make(1);
  RunUntil(kStart + kMillisecond);
  const std::size_t before = link_.written().size();
  const MonoNs babble = clock_.Now();
  for (MonoNs at = 0; at < kSecond; at += 100 * kMicrosecond) link_.ArriveAt(babble + at, {0x55});
  // Every call returns soon, so that the driver can tick and stop.
  while (clock_.Now() < babble + kSecond - kMillisecond) {
    const MonoNs called = clock_.Now();
    bus_->RunOnce(kNever);
    EXPECT_LE(clock_.Now() - called, PolledDevice::kTimeout);
  }
  EXPECT_EQ(link_.written().size(), before);
  RunUntil(babble + kSecond + 10 * kMillisecond);
  EXPECT_GT(link_.written().size(), before);
}

TEST_F(BusTest, AMissingPortIsTriedAgainWithGrowingPauses) {
  link_.RefuseOpens(9, "no such port: plug it in");
  Make(1);
  RunUntil(kStart + 20 * kSecond);
  std::vector<MonoNs> pauses;
  for (std::size_t i = 1; i < link_.open_times().size(); ++i) {
    pauses.push_back((link_.open_times()[i] - link_.open_times()[i - 1]) / kMillisecond);
  }
  EXPECT_THAT(pauses, ElementsAre(50, 100, 200, 400, 800, 1'600, 2'000, 2'000, 2'000));
  EXPECT_THAT(observer_.lines, ElementsAre("down: no such port: plug it in", "up"));
  EXPECT_FALSE(output_.samples.empty());
  EXPECT_EQ(bus_->counters().reopens, 0);
}

TEST_F(BusTest, APulledAdapterComesBackByItself) {
  Make(2, Every(kMillisecond));
  link_.LoseAt(kStart + 10 * kSecond + 50 * kMicrosecond);  // in the middle of an exchange
  link_.SetErrors({.framing = 3, .dropped = 2});
  RunUntil(kStart + 10 * kSecond + kMillisecond);
  EXPECT_FALSE(bus_->up());
  EXPECT_THAT(bus_->problem(), HasSubstr("the line was lost"));
  EXPECT_EQ(devices_[0]->told.back(), Event::Kind::kLinkDown);
  EXPECT_EQ(devices_[1]->told.back(), Event::Kind::kLinkDown);
  const std::size_t before = output_.samples.size();
  RunUntil(kStart + 10 * kSecond + 100 * kMillisecond);
  EXPECT_TRUE(bus_->up());
  EXPECT_EQ(bus_->counters().reopens, 1);
  EXPECT_EQ(bus_->counters().line.framing, 6);  // three before, three since
  EXPECT_GT(output_.samples.size(), before);
  EXPECT_EQ(bus_->late(), 0);  // slots without a line are nobody's fault
}

TEST_F(BusTest, ALineThatBreaksAtOnceIsNotHammered) {
  Make(1);
  for (int i = 0; i < 2'000 && clock_.Now() < kStart + 30 * kSecond; ++i) {
    if (bus_->up()) link_.LoseAt(clock_.Now());
    bus_->RunOnce(kStart + 30 * kSecond);
  }
  EXPECT_LE(link_.open_times().size(), 22U);
}

TEST_F(BusTest, AClosedLinesSleepEndsWhenWoken) {
  link_.RefuseOpens(100, "gone");
  Make(1);
  RunUntil(kStart + 10 * kSecond);
  link_.WakeAt(clock_.Now() + 5 * kMillisecond);
  const MonoNs before = clock_.Now();
  bus_->RunOnce(kNever);
  EXPECT_LE(clock_.Now() - before, 5 * kMillisecond);
}

TEST_F(BusTest, OneDeadUnitCostsTheOthersLittle) {
  constexpr MonoNs kTime = 10 * kSecond;
  BusSettings settings;
  settings.schedule.pause_most_shared = 2 * kSecond;
  link_.SetPeer(PolledDevices({2}));
  Make(16, settings);
  RunUntil(kStart + kTime);
  std::int64_t others = 0;
  for (const auto& device : devices_) {
    if (device != devices_[2]) others += static_cast<std::int64_t>(device->started.size());
  }
  const std::int64_t possible = kTime / (100 * kMicrosecond);
  EXPECT_GT(others, possible * 95 / 100);
}

TEST_F(BusTest, ADeadEncoderAloneOnItsBusIsBackWithin100Milliseconds) {
  link_.SetPeer(PolledDevices({0}));
  Make(1);
  RunUntil(kStart + 60 * kSecond);
  EXPECT_TRUE(output_.samples.empty());
  EXPECT_LT(link_.written().size(), 700U);
  link_.SetPeer(PolledDevices());
  RunUntil(kStart + 60 * kSecond + 100 * kMillisecond + PolledDevice::kTimeout);
  EXPECT_FALSE(output_.samples.empty());
}

}  // namespace
}  // namespace axlecast
