#include "drivers/runtime/bus/transactor.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/bus/wire_log.h"
#include "tests/support/memory_sink.h"
#include "tests/support/scripted_frame_link.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr MonoNs kStart = 1'000 * kSecond;
constexpr MonoNs kSoon = kStart + kMillisecond;

std::vector<std::uint8_t> Copy(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

class FrameMediumTest : public ::testing::Test {
 protected:
  FrameMediumTest() { EXPECT_EQ(ErrorText(link_.Open()), ""); }

  FakeClock clock_{kStart};
  ScriptedFrameLink link_{clock_};
  CanTransactor medium_{link_, clock_};
  const Step send_{.action = Send{{.id = 0x220, .data = {0x80, 0x20}}}};
  const Step listen_{.action = Listen{kStart + kSecond}};
};

TEST_F(FrameMediumTest, AFrameThatIsSentIsToldAgainWhenANodeHasAcknowledgedIt) {
  link_.SetSendTime(500 * kMicrosecond);
  const Event* event = medium_.Run(send_, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kSent);
  EXPECT_EQ(event->id, 0x220U);
  EXPECT_THAT(Copy(event->bytes), ElementsAre(0x80, 0x20));
  event = medium_.Run(listen_, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kConfirmed);
  EXPECT_EQ(event->id, 0x220U);
  EXPECT_EQ(event->received.last, kStart + 500 * kMicrosecond);
}

TEST_F(FrameMediumTest, AFullQueueIsToldAndNothingIsLost) {
  link_.SetQueue(0);
  const Event* event = medium_.Run(send_, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kNotSent);
  EXPECT_EQ(event->id, 0x220U);
  EXPECT_THAT(link_.sent(), IsEmpty());
}

TEST_F(FrameMediumTest, FramesComeOneByOneInTheirOrderWithTheirInstants) {
  link_.ArriveAt(kStart, {.id = 0x120, .data = {1}});
  link_.ArriveAt(kStart, {.id = 0x121, .data = {2}});
  link_.ArriveAt(kStart + 300, {.id = 0x20000040, .data = {}});
  std::vector<std::uint32_t> ids;
  for (int i = 0; i < 3; ++i) {
    const Event* event = medium_.Run(listen_, kSoon);
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->kind, Event::Kind::kFrame);
    ids.push_back(event->id);
  }
  EXPECT_THAT(ids, ElementsAre(0x120, 0x121, 0x20000040));
  EXPECT_EQ(clock_.Now(), kStart + 300);
}

TEST_F(FrameMediumTest, ListeningEndsAsSilentAtItsEndAndAsNothingBefore) {
  EXPECT_EQ(medium_.Run(listen_, kSoon), nullptr);
  EXPECT_EQ(clock_.Now(), kSoon);
  const Event* event = medium_.Run(listen_, kStart + 2 * kSecond);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kSilent);
  EXPECT_EQ(event->received, (Interval{kSoon, kStart + kSecond}));
}

TEST_F(FrameMediumTest, AWakeEndsItWithoutAnEvent) {
  link_.WakeAt(kStart + 10);
  EXPECT_EQ(medium_.Run(listen_, kSoon), nullptr);
  EXPECT_EQ(clock_.Now(), kStart + 10);
}

TEST_F(FrameMediumTest, ALostInterfaceIsALinkThatIsDown) {
  link_.LoseAt(kStart + 5);
  const Event* event = medium_.Run(listen_, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kLinkDown);
  event = medium_.Run(send_, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kLinkDown);
}

TEST_F(FrameMediumTest, AStepOfALineOfBytesIsNoStepOfThisBus) {
  const Step pulse{.action = Pulse{.line = 0, .low = 1}};
  const Event* event = medium_.Run(pulse, kSoon);
  ASSERT_NE(event, nullptr);
  EXPECT_EQ(event->kind, Event::Kind::kLinkDown);
}

// ---- on a bus of several ----

// An event that owns its bytes; of frames, also the id.
struct Told {
  Event::Kind kind;
  Interval received;
  std::uint32_t id;
  std::vector<std::uint8_t> bytes;
  friend bool operator==(const Told&, const Told&) = default;
};

// Sends the given frames, then listens for this time at once.
class Node final : public Device {
 public:
  explicit Node(MonoNs patience) : patience_(patience) {}
  std::deque<CanFrame> to_send;
  std::vector<Told> told;

  [[nodiscard]] Step Next(const BusSlot&) const override {
    if (!to_send.empty()) return {.action = Send{to_send.front()}, .priority = Priority::kCommand};
    return {.action = Listen{deadline_}};
  }
  void OnStarted(const Step&, MonoNs) override { to_send.pop_front(); }
  void On(const Event& event) override {
    if (event.kind == Event::Kind::kLinkUp || event.kind == Event::Kind::kSilent) {
      deadline_ = event.received.last + patience_;
    }
    told.push_back({event.kind, event.received, event.id, Copy(event.bytes)});
  }
  [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override { return {}; }
  void Begin(const DriverCommand&, MonoNs) override {}
  [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return false; }

 private:
  MonoNs patience_;
  MonoNs deadline_ = 0;
};

class Nobody final : public BusObserver {
  void OnLink(bool, std::string_view, MonoNs) override {}
};

class CanBusTest : public ::testing::Test {
 protected:
  CanBusTest() {
    time_.Update(kStart, 1'700'000'000'000'000);
    bus_.Add(quick_);
    bus_.Add(slow_);
  }
  void RunUntil(MonoNs until) {
    while (clock_.Now() < until) bus_.RunOnce(until);
  }
  static std::size_t Count(const Node& node, Event::Kind kind) {
    return static_cast<std::size_t>(
        std::count_if(node.told.begin(), node.told.end(), [kind](const Told& told) { return told.kind == kind; }));
  }

  FakeClock clock_{kStart};
  ScriptedFrameLink link_{clock_};
  Timebase time_;
  MemorySink sink_;
  WireLog log_{"can-0", Origin{.boot_id = 42}, time_, sink_, {.kind = wire_t::KIND_CAN, .clock_hz = 0}};
  Nobody nobody_;
  Bus bus_{{}, link_, clock_, nobody_, &log_};
  Node quick_{30 * kMillisecond};
  Node slow_{100 * kMillisecond};
};

TEST_F(CanBusTest, EveryDeviceHearsEveryFrameAndIsSilentAtItsOwnTime) {
  for (int i = 0; i < 200; ++i) link_.ArriveAt(kStart + i * 5 * kMillisecond, {.id = 0x120, .data = {1, 2}});
  RunUntil(kStart + kSecond);
  EXPECT_EQ(Count(quick_, Event::Kind::kFrame), 200U);
  EXPECT_EQ(Count(slow_, Event::Kind::kFrame), 200U);
  EXPECT_EQ(bus_.counters().exchanges, 200);
  EXPECT_NEAR(static_cast<double>(Count(quick_, Event::Kind::kSilent)), 33, 1);
  EXPECT_NEAR(static_cast<double>(Count(slow_, Event::Kind::kSilent)), 10, 1);
}

TEST_F(CanBusTest, WhatADeviceSendsGoesOutBetweenTheFramesOfOthers) {
  RunUntil(kStart + kMillisecond);
  for (int i = 0; i < 50; ++i) link_.ArriveAt(clock_.Now(), {.id = 0x120, .data = {1, 2}});
  slow_.to_send.push_back({.id = 0x221, .data = {0x20, 0x21}});
  bus_.RunOnce(kStart + 2 * kMillisecond);
  ASSERT_EQ(link_.sent().size(), 1U);
  EXPECT_EQ(link_.sent()[0].id, 0x221U);
  RunUntil(kStart + 3 * kMillisecond);
  EXPECT_EQ(Count(quick_, Event::Kind::kFrame), 50U);
  EXPECT_EQ(Count(quick_, Event::Kind::kConfirmed), 1U);
}

TEST_F(CanBusTest, ARecordingHoldsAllOfItWithIdentifiersAndInstants) {
  link_.ArriveAt(kStart + kMillisecond, {.id = 0x120, .data = {0x47, 0x26, 0, 0, 0, 0, 0, 0}});
  link_.ArriveAt(kStart + 2 * kMillisecond, {.id = kCanExtended | 0x1234567, .data = {}});
  link_.ArriveAt(kStart + 2 * kMillisecond, {.id = kCanError | 0x40, .data = {0, 0, 0, 0, 0, 0, 0, 0}});
  quick_.to_send.push_back({.id = 0x220, .data = {0x20, 0x20}});
  link_.LoseAt(kStart + 150 * kMillisecond);
  RunUntil(kStart + 200 * kMillisecond);
  log_.Flush();

  std::vector<Told> again;
  WireReader reader;
  for (const wire_t& message : sink_.All<wire_t>("WIRE/can-0")) {
    EXPECT_EQ(message.kind, wire_t::KIND_CAN);
    reader.Read(message, [&](const Event& event) {
      if (event.device > 0) return;
      again.push_back({event.kind, event.received, event.id, Copy(event.bytes)});
    });
  }
  EXPECT_EQ(reader.unreadable(), 0);
  EXPECT_EQ(again, quick_.told);
  EXPECT_GT(Count(slow_, Event::Kind::kSilent), 0U);
}

}  // namespace
}  // namespace axlecast
