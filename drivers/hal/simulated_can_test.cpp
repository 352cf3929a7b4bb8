#include "drivers/hal/simulated_can.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <filesystem>
#include <vector>

#include "core/base/result.h"
#include "core/device/link.h"
#include "drivers/hal/simulated_port_test_support.h"
#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using SendResult = FrameLink::SendResult;
using State = CanController::State;
using Status = Link::Status;

CanFrame Frame(std::uint32_t id, std::initializer_list<std::uint8_t> data = {}) { return {.id = id, .data = data}; }

std::vector<std::uint8_t> Data(const CanFrame& frame) {
  const Bytes data = frame.data;
  return {data.begin(), data.end()};
}

// Answers each frame that it receives with the next identifier.
class Node final : public Simulator {
 public:
  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs, const Transmit& transmit) override {
    ++offered;
    if (!hears) return false;
    heard.push_back(frame);
    transmit(ToPacket({.id = frame.id + 1, .data = frame.data}));
    return true;
  }
  void OnBaud(std::int64_t rate) override { bitrates.push_back(rate); }
  [[nodiscard]] MonoNs NextDue() const override { return kNever; }
  void OnDue(MonoNs, const Transmit&) override {}
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  bool hears = true;
  int offered = 0;
  std::vector<CanFrame> heard;
  std::vector<std::int64_t> bitrates;
};

class SimulatedCanTest : public ::testing::Test {
 protected:
  SimulatedCanTest() {
    EXPECT_EQ(ErrorText(port_.Plug()), "");
    EXPECT_EQ(Open(can_), "");
  }

  [[nodiscard]] std::string Open(SimulatedCan& can) {
    return Served(port_, [&can] { return ErrorText(can.Open()); });
  }
  // What has come by now, served or not; "own" or "", the identifier.
  [[nodiscard]] std::vector<std::pair<bool, std::uint32_t>> Received() {
    std::vector<std::pair<bool, std::uint32_t>> frames;
    for (FrameLink::Received one; can_.Receive(one) == Status::kOk;) frames.emplace_back(one.own, one.frame.id);
    return frames;
  }
  // As the simulator's process does when the frame that waits is due.
  void SendAgain() {
    ASSERT_NE(port_.NextDue(), kNever);
    while (clock_.Now() < port_.NextDue()) {
    }
    port_.Serve();
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/b0.can";
  Node node_;
  SimulatedCanPort port_{path_, node_, clock_};
  SimulatedCan can_{path_, 250'000, clock_};
};

TEST_F(SimulatedCanTest, AFrameIsConfirmedAndThenAnswered) {
  EXPECT_THAT(node_.bitrates, ElementsAre(250'000));
  EXPECT_TRUE(port_.HasHost());
  EXPECT_EQ(can_.Send(Frame(0x181, {1, 2, 3, 4, 5, 6, 7, 8})), SendResult::kQueued);
  EXPECT_EQ(can_.Controller().pending, 1);
  port_.Serve();
  ASSERT_EQ(node_.heard.size(), 1U);
  EXPECT_EQ(node_.heard[0].id, 0x181U);
  EXPECT_THAT(Data(node_.heard[0]), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));

  const MonoNs before = clock_.Now();
  EXPECT_EQ(can_.Wait(before + 60 * kSecond), Status::kOk);
  FrameLink::Received received;
  ASSERT_EQ(can_.Receive(received), Status::kOk);
  EXPECT_TRUE(received.own) << "on the bus before what answers it";
  EXPECT_EQ(received.frame.id, 0x181U);
  EXPECT_GE(received.at.first, before);
  EXPECT_LE(received.at.last, clock_.Now());
  ASSERT_EQ(can_.Receive(received), Status::kOk);
  EXPECT_FALSE(received.own);
  EXPECT_EQ(received.frame.id, 0x182U);
  EXPECT_EQ(can_.Receive(received), Status::kTimeout);
  EXPECT_EQ(can_.Controller().pending, 0);
}

TEST_F(SimulatedCanTest, AllKindsOfFramesPass) {
  for (const std::uint32_t id : {0U, 0x7FFU, 0x123U | kCanRemote, 0x1FFF'FFF0U | kCanExtended}) {
    EXPECT_EQ(can_.Send(Frame(id)), SendResult::kQueued);
    port_.Serve();
    EXPECT_EQ(Received(), (std::vector<std::pair<bool, std::uint32_t>>{{true, id}, {false, id + 1}}));
  }
}

TEST_F(SimulatedCanTest, WhatTheNodesSendOnTheirOwnComes) {
  port_.Transmit(ToPacket(Frame(0x702, {5})));
  EXPECT_EQ(Received(), (std::vector<std::pair<bool, std::uint32_t>>{{false, 0x702}}));
}

// ISO 11898-1 12.1.4: 8 for each attempt, up to 128; 1 less for each frame that was acknowledged.
TEST_F(SimulatedCanTest, AFrameThatNobodyAcknowledgesIsSentAgainUntilSomebodyDoes) {
  EXPECT_EQ(can_.Controller().state, State::kActive);
  node_.hears = false;
  EXPECT_EQ(can_.Send(Frame(0x80)), SendResult::kQueued);
  port_.Serve();
  SendAgain();
  EXPECT_EQ(node_.offered, 2);
  EXPECT_TRUE(Received().empty());
  EXPECT_EQ(can_.Controller().unacknowledged, 1) << "once, however often it is tried";
  EXPECT_EQ(can_.Controller().state, State::kPassive);
  EXPECT_EQ(can_.Controller().tec, 128);
  EXPECT_EQ(can_.Controller().pending, 1);

  node_.hears = true;
  SendAgain();
  EXPECT_EQ(Received(), (std::vector<std::pair<bool, std::uint32_t>>{{true, 0x80}, {false, 0x81}}));
  EXPECT_EQ(port_.NextDue(), kNever);
  EXPECT_EQ(can_.Controller().state, State::kWarning);
  EXPECT_EQ(can_.Controller().tec, 127);
  for (int i = 0; i < 32; ++i) {
    ASSERT_EQ(can_.Send(Frame(0x80)), SendResult::kQueued);
    port_.Serve();
    ASSERT_EQ(Received().size(), 2U);
  }
  EXPECT_EQ(can_.Controller().state, State::kActive);
  EXPECT_EQ(can_.Controller().tec, 95);
}

TEST_F(SimulatedCanTest, TheQueueBehindAFrameThatNobodyAcknowledgesIsShort) {
  node_.hears = false;
  int queued = 0;
  while (queued < 100 && can_.Send(Frame(0x200U + static_cast<std::uint32_t>(queued))) == SendResult::kQueued) {
    ++queued;
    port_.Serve();
  }
  EXPECT_GE(queued, 5);
  EXPECT_LE(queued, 30);
  EXPECT_EQ(can_.Controller().queue_full, 1);
  EXPECT_EQ(can_.Controller().pending, queued);
  node_.hears = true;
  SendAgain();
  port_.Serve();
  EXPECT_EQ(node_.heard.size(), static_cast<std::size_t>(queued)) << "none is lost";
  EXPECT_EQ(node_.heard.back().id, 0x200U + static_cast<std::uint32_t>(queued) - 1);
  EXPECT_EQ(Received().size(), 2 * static_cast<std::size_t>(queued));
  EXPECT_EQ(can_.Controller().pending, 0);
}

TEST_F(SimulatedCanTest, WhatAHostLeavesBehindStillGoesOut) {
  node_.hears = false;
  for (const std::uint32_t id : {0x10U, 0x20U, 0x30U}) EXPECT_EQ(can_.Send(Frame(id)), SendResult::kQueued);
  port_.Serve();
  can_.Close();
  ASSERT_EQ(Open(can_), "");
  EXPECT_EQ(can_.Send(Frame(0x40)), SendResult::kQueued);
  port_.Serve();
  node_.hears = true;
  SendAgain();
  port_.Serve();
  EXPECT_EQ(Received(), (std::vector<std::pair<bool, std::uint32_t>>{{false, 0x10},
                                                                     {false, 0x11},
                                                                     {false, 0x20},
                                                                     {false, 0x21},
                                                                     {false, 0x30},
                                                                     {false, 0x31},
                                                                     {true, 0x40},
                                                                     {false, 0x41}}))
      << "the others are not its own";
}

TEST_F(SimulatedCanTest, PullingThePortOutDropsWhatWaits) {
  node_.hears = false;
  EXPECT_EQ(can_.Send(Frame(0x10)), SendResult::kQueued);
  port_.Serve();
  port_.Unplug();
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_FALSE(port_.HasHost());
  EXPECT_EQ(port_.NextDue(), kNever);
  EXPECT_EQ(can_.Send(Frame(0x11)), SendResult::kLost);
  FrameLink::Received received;
  while (can_.Receive(received) == Status::kOk) {
  }
  EXPECT_EQ(can_.Receive(received), Status::kLost);
  EXPECT_THAT(ErrorText(can_.Open()), HasSubstr("--plug"));

  ASSERT_EQ(ErrorText(port_.Plug()), "");
  ASSERT_EQ(Open(can_), "");
  node_.hears = true;
  port_.Serve();
  EXPECT_TRUE(node_.heard.empty());
  EXPECT_THAT(node_.bitrates, ElementsAre(250'000)) << "not passed again: it is the same";
}

TEST_F(SimulatedCanTest, ANewHostBringsItsOwnBitRate) {
  can_.Close();
  SimulatedCan fast(path_, 1'000'000, clock_);
  ASSERT_EQ(Open(fast), "");
  EXPECT_THAT(node_.bitrates, ElementsAre(250'000, 1'000'000));
  EXPECT_EQ(fast.Controller().bitrate, 1'000'000);
  EXPECT_EQ(fast.Controller().restart_ms, 0);
}

TEST_F(SimulatedCanTest, OneHostAtATime) {
  SimulatedCan second(path_, 250'000, clock_);
  EXPECT_THAT(Open(second), ::testing::EndsWith(kLineHeld));
  EXPECT_EQ(can_.Send(Frame(1)), SendResult::kQueued);
  port_.Serve();
  EXPECT_EQ(Received().size(), 2U) << "the first remains";
}

TEST_F(SimulatedCanTest, WakeEndsAWait) {
  can_.Wake();
  EXPECT_EQ(can_.Wait(clock_.Now() + 60 * kSecond), Status::kWoken);
  EXPECT_EQ(can_.Wait(clock_.Now()), Status::kTimeout);
}

TEST_F(SimulatedCanTest, OnlyThisUserReachesIt) {
  struct stat status {};
  ASSERT_EQ(stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
}

TEST_F(SimulatedCanTest, WithoutASimulatorItTellsWhatToDo) {
  SimulatedCan lost(folder_.path() + "/can-7.can", 250'000, clock_);
  EXPECT_THAT(ErrorText(lost.Open()), HasSubstr("axlecast simulate FILE --bus can-7"));
  EXPECT_FALSE(lost.IsOpen());
  EXPECT_EQ(lost.Send(Frame(1)), SendResult::kLost);
  FrameLink::Received received;
  EXPECT_EQ(lost.Receive(received), Status::kLost);
  EXPECT_EQ(lost.Wait(clock_.Now()), Status::kTimeout);
  EXPECT_THAT(ErrorText(SimulatedCan(std::string(200, 'x'), 1, clock_).Open()), HasSubstr("AXLECAST_RUN_DIR"));
}

// ---- packets outside the protocol ----

class SimulatedCanNonsenseTest : public SimulatedCanTest {
 protected:
  SimulatedCanNonsenseTest() {
    can_.Close();
    port_.Serve();
  }
  // Whether the port still takes the host for one after these packets.
  [[nodiscard]] bool Survives(const std::vector<std::vector<std::uint8_t>>& packets) {
    SimulatedSocket host;
    const std::string problem =
        Served(port_, [&] { return ErrorText(host.Connect(path_, "axlecast-can-1", clock_)); });
    EXPECT_EQ(problem, "");
    for (const auto& packet : packets) {
      if (host.Send(packet) != FrameLink::SendResult::kQueued) return false;
      port_.Serve();
    }
    std::array<std::uint8_t, 32> answer{};
    return host.Receive(answer).status != Link::Status::kLost;
  }

  const std::vector<std::uint8_t> bitrate_ = {'B', 0, 3, 0xD0, 0x90};
};

TEST_F(SimulatedCanNonsenseTest, WhoSendsItIsCutOff) {
  EXPECT_TRUE(Survives({bitrate_}));
  EXPECT_TRUE(Survives({bitrate_, {'F', 0, 0, 1, 0x81}}));
  EXPECT_FALSE(Survives({{'F', 0, 0, 1, 0x81}})) << "no bit rate before";
  EXPECT_FALSE(Survives({{'B', 0, 0, 0, 0}})) << "of nothing";
  EXPECT_FALSE(Survives({{'B', 1}}));
  EXPECT_FALSE(Survives({bitrate_, bitrate_}));
  EXPECT_FALSE(Survives({bitrate_, {'F'}}));
  EXPECT_FALSE(Survives({bitrate_, {'F', 0, 0, 1}})) << "no whole identifier";
  EXPECT_FALSE(Survives({bitrate_, {'F', 0, 0, 1, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9}})) << "nine bytes";
  EXPECT_FALSE(Survives({bitrate_, std::vector<std::uint8_t>(600, 'F')}));
  EXPECT_FALSE(Survives({bitrate_, {'A', 0, 0, 1, 1}}));
  ASSERT_EQ(Open(can_), "") << "and another is welcome";
}

TEST_F(SimulatedCanNonsenseTest, AnotherProtocolIsRefused) {
  SimulatedSocket host;
  EXPECT_THAT(Served(port_, [&] { return ErrorText(host.Connect(path_, "axlecast-can-2", clock_)); }),
              HasSubstr("not this version's simulator"));
}

TEST_F(SimulatedCanNonsenseTest, ASimulatorThatSendsItIsAsGoodAsGone) {
  for (const auto& packet : std::vector<std::vector<std::uint8_t>>{
           {'F'}, {'F', 0, 0, 1}, {'X', 0, 0, 0, 1}, std::vector<std::uint8_t>(14, 'F')}) {
    const std::string path = folder_.path() + "/fake.can";
    SimulatedSocketPort fake;
    ASSERT_EQ(ErrorText(fake.Listen(path, "axlecast-can-1")), "");
    SimulatedCan can(path, 250'000, clock_);
    std::thread opener([&] { EXPECT_EQ(ErrorText(can.Open()), ""); });
    while (!fake.Welcome()) {
    }
    opener.join();
    ASSERT_TRUE(fake.Send(packet));
    FrameLink::Received received;
    EXPECT_EQ(can.Receive(received), Status::kLost);
  }
}

TEST_F(SimulatedCanNonsenseTest, ASimulatorThatSaysNothingIsNamed) {
  const std::string path = folder_.path() + "/deaf.can";
  const Result<Descriptor> deaf = BindUnixSocket(path, SOCK_SEQPACKET);
  ASSERT_TRUE(deaf);
  ASSERT_EQ(listen(deaf->get(), 1), 0);
  EXPECT_THAT(ErrorText(SimulatedCan(path, 1, clock_).Open()), HasSubstr("does not answer"));
}

}  // namespace
}  // namespace axlecast
