#include "tests/support/simulator_frame_link.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using Status = Link::Status;
using SendResult = FrameLink::SendResult;

// Answers each frame at once, and sends a frame of its own 5 ms later.
class Node final : public Simulator {
 public:
  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) override {
    ++offered;
    if (!hears) return false;
    transmit(ToPacket({.id = frame.id + 1, .data = {1, 2}}));
    due_ = now + 5 * kMillisecond;
    return true;
  }
  void OnBaud(std::int64_t rate) override { bitrate = rate; }
  [[nodiscard]] MonoNs NextDue() const override { return due_; }
  void OnDue(MonoNs, const Transmit& transmit) override {
    due_ = kNever;
    transmit(ToPacket({.id = 0x700, .data = {}}));
  }
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  bool hears = true;
  int offered = 0;
  std::int64_t bitrate = 0;

 private:
  MonoNs due_ = kNever;
};

class SimulatorFrameLinkTest : public ::testing::Test {
 protected:
  SimulatorFrameLinkTest() { EXPECT_EQ(ErrorText(link_.Open()), ""); }

  // What comes within 100 ms: "own" or nothing, the identifier and the number of its bytes, the time in ms.
  [[nodiscard]] std::vector<std::string> Heard() {
    std::vector<std::string> heard;
    const MonoNs begin = clock_.Now();
    while (link_.Wait(begin + 100 * kMillisecond) == Status::kOk) {
      FrameLink::Received one;
      if (link_.Receive(one) != Status::kOk) break;
      heard.push_back((one.own ? "own " : "") + std::to_string(one.frame.id) + ' ' +
                      std::to_string(one.frame.data.size()) + ' ' +
                      std::to_string((one.at.first - begin) / kMillisecond));
    }
    return heard;
  }

  using Texts = std::vector<std::string>;
  FakeClock clock_;
  Node node_;
  SimulatorFrameLink link_{clock_, node_, 250'000};
};

TEST_F(SimulatorFrameLinkTest, FramesComeInTheirOrderAndTime) {
  EXPECT_EQ(node_.bitrate, 250'000);
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {9}}), SendResult::kQueued);
  EXPECT_EQ(Heard(), (Texts{"own 16 1 0", "17 2 0", "1792 0 5"}));
  EXPECT_EQ(link_.writes(), 1);
  EXPECT_EQ(link_.waits(), 4);
}

TEST_F(SimulatorFrameLinkTest, WhatNobodyAcknowledgesIsSentAgain) {
  node_.hears = false;
  int queued = 0;
  while (link_.Send({.id = 0x10, .data = {}}) == SendResult::kQueued) ++queued;
  EXPECT_EQ(queued, 11);
  EXPECT_EQ(Heard(), Texts{});
  EXPECT_GE(node_.offered, 100);
  CanController controller = link_.Controller();
  EXPECT_EQ(controller.state, CanController::State::kPassive);
  EXPECT_EQ(controller.tec, 128);
  EXPECT_EQ(controller.unacknowledged, 1);
  EXPECT_EQ(controller.pending, 11);
  EXPECT_EQ(controller.queue_full, 1);
  node_.hears = true;
  EXPECT_EQ(Heard().size(), 2 * 11 + 1U);
  controller = link_.Controller();
  EXPECT_EQ(controller.state, CanController::State::kActive);
  EXPECT_EQ(controller.pending, 0);
}

TEST_F(SimulatorFrameLinkTest, WhatWaitsOutlastsTheLinkButNotTheInterface) {
  node_.hears = false;
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {}}), SendResult::kQueued);
  link_.Close();
  EXPECT_EQ(ErrorText(link_.Open()), "");
  node_.hears = true;
  EXPECT_EQ(Heard(), (Texts{"16 0 1", "17 2 1", "1792 0 6"})) << "not an own one any more";

  node_.hears = false;
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {}}), SendResult::kQueued);
  link_.Unplug();
  EXPECT_EQ(link_.Wait(clock_.Now() + kSecond), Status::kLost);
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {}}), SendResult::kLost);
  link_.Close();
  EXPECT_NE(ErrorText(link_.Open()), "");
  link_.Plug();
  EXPECT_EQ(ErrorText(link_.Open()), "");
  node_.hears = true;
  EXPECT_EQ(Heard(), Texts{});
}

TEST_F(SimulatorFrameLinkTest, DamageChangesTheDataOfWhatComes) {
  link_.SetDamage([](std::vector<std::uint8_t>& bytes) { bytes.resize(40, 0xFF); });
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {9}}), SendResult::kQueued);
  EXPECT_EQ(Heard(), (Texts{"own 16 1 0", "17 8 0", "1792 8 5"})) << "own frames are not damaged";
  link_.SetDamage([](std::vector<std::uint8_t>& bytes) { bytes.clear(); });
  EXPECT_EQ(link_.Send({.id = 0x10, .data = {9}}), SendResult::kQueued);
  EXPECT_EQ(Heard(), (Texts{"own 16 1 0"}));
}

}  // namespace
}  // namespace axlecast
