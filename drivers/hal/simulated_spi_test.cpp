#include "drivers/hal/simulated_spi.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <numeric>
#include <vector>

#include "core/device/link.h"
#include "drivers/hal/simulated_port_test_support.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Status = Link::Status;

// Sends the number of the transfer, the first byte clocked out, and its place in the rest.
class Slave final : public Simulator {
 public:
  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override {
    settings.push_back(transfer.settings);
    bits_per_word = transfer.bits_per_word;
    first_edge = now;
    std::iota(rx.begin(), rx.end(), std::uint8_t{0});
    rx[0] = static_cast<std::uint8_t>(settings.size());
    if (rx.size() > 1) rx[1] = transfer.tx[0];
    EXPECT_EQ(rx.size(), transfer.tx.size());
  }
  [[nodiscard]] MonoNs NextDue() const override { return kNever; }
  void OnDue(MonoNs, const Transmit&) override {}
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  std::vector<SpiSettings> settings;
  int bits_per_word = 0;
  MonoNs first_edge = 0;
};

class SimulatedSpiTest : public ::testing::Test {
 protected:
  SimulatedSpiTest() {
    EXPECT_EQ(ErrorText(port_.Plug()), "");
    EXPECT_EQ(Open(spi_), "");
  }

  [[nodiscard]] std::string Open(SimulatedSpi& spi) {
    return Served(port_, [&spi] { return ErrorText(spi.Open()); });
  }
  [[nodiscard]] bool Write(Bytes bytes) {
    return Served(port_, [&] { return spi_.Write(bytes); });
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/b0.spi";
  Slave slave_;
  SimulatedSpiPort port_{path_, slave_, clock_};
  SimulatedSpi spi_{path_, {.mode = 2, .clock_hz = 400'000}, clock_};
};

TEST_F(SimulatedSpiTest, WhatWasClockedInWaitsToBeRead) {
  std::array<std::uint8_t, 16> into{};
  EXPECT_EQ(spi_.ReadNow(into).status, Status::kTimeout);
  ASSERT_TRUE(Write(std::array<std::uint8_t, 4>{0x55, 0, 0, 0}));
  EXPECT_THAT(slave_.settings, ElementsAre(SpiSettings{.mode = 2, .clock_hz = 400'000}));
  EXPECT_EQ(slave_.bits_per_word, 8);
  EXPECT_EQ(spi_.Wait(clock_.Now() + 60 * kSecond), Status::kOk);
  ByteLink::ReadResult read = spi_.Read(std::span(into).first(3), clock_.Now() + 60 * kSecond);
  EXPECT_EQ(read.status, Status::kOk);
  ASSERT_EQ(read.count, 3U);
  read = spi_.ReadNow(std::span(into).subspan(3));
  ASSERT_EQ(read.count, 1U);
  EXPECT_THAT(std::span(into).first(4), ElementsAre(1, 0x55, 2, 3));
  EXPECT_EQ(spi_.ReadNow(into).status, Status::kTimeout);
}

TEST_F(SimulatedSpiTest, ATransferTakesTheTimeOfItsClocks) {
  const MonoNs before = clock_.Now();
  ASSERT_TRUE(Write(std::vector<std::uint8_t>(100)));
  const MonoNs after = clock_.Now();
  const MonoNs clocks = 800 * kSecond / 400'000;
  EXPECT_GE(slave_.first_edge, before);
  EXPECT_LE(slave_.first_edge, after - clocks);
}

TEST_F(SimulatedSpiTest, WhatWasNotReadIsDroppedByTheNextTransfer) {
  ASSERT_TRUE(Write(std::array<std::uint8_t, 1>{}));
  ASSERT_TRUE(Write(std::array<std::uint8_t, 1>{}));
  std::array<std::uint8_t, 4> into{};
  ASSERT_EQ(spi_.ReadNow(into).count, 1U);
  EXPECT_EQ(into[0], 2);
}

TEST_F(SimulatedSpiTest, TheLongestTransferIsOneFrame) {
  ASSERT_TRUE(Write(std::vector<std::uint8_t>(kMaxFrame)));
  std::array<std::uint8_t, kMaxFrame> into{};
  EXPECT_EQ(spi_.ReadNow(into).count, kMaxFrame);
  EXPECT_FALSE(spi_.Write(std::vector<std::uint8_t>(kMaxFrame + 1)));
  EXPECT_FALSE(spi_.Write({}));
}

TEST_F(SimulatedSpiTest, ATransferMayHaveSettingsOfItsOwn) {
  std::array<std::uint8_t, 2> rx{};
  const std::array<std::uint8_t, 2> tx{0xAB, 0};
  const SpiTransfer transfer{.settings = {.mode = 0xFB, .clock_hz = 4'000'000'000}, .bits_per_word = 13, .tx = tx};
  ASSERT_TRUE(Served(port_, [&] { return spi_.Transfer(transfer, rx); }));
  EXPECT_THAT(rx, ElementsAre(1, 0xAB));
  EXPECT_EQ(slave_.settings.back(), transfer.settings);
  EXPECT_EQ(slave_.bits_per_word, 13);
  EXPECT_FALSE(spi_.Transfer(transfer, std::span(rx).first(1))) << "not as long";
}

TEST_F(SimulatedSpiTest, ReadWaitsUntilItsDeadlineForNothing) {
  std::array<std::uint8_t, 4> into{};
  spi_.Wake();
  const MonoNs deadline = clock_.Now() + 20 * kMillisecond;
  EXPECT_EQ(spi_.Read(into, deadline).status, Status::kTimeout);
  EXPECT_GE(clock_.Now(), deadline);
  EXPECT_EQ(spi_.Wait(clock_.Now() + 60 * kSecond), Status::kWoken) << "Read has not eaten it";
  EXPECT_FALSE(spi_.SetBaud(9'600));
}

TEST_F(SimulatedSpiTest, UnpluggedItIsLostAndComesBack) {
  EXPECT_TRUE(port_.HasHost());
  port_.Unplug();
  EXPECT_FALSE(port_.HasHost());
  std::array<std::uint8_t, 4> into{};
  EXPECT_EQ(spi_.Wait(clock_.Now() + 60 * kSecond), Status::kLost);
  EXPECT_EQ(spi_.Read(into, clock_.Now() + 60 * kSecond).status, Status::kLost);
  EXPECT_FALSE(spi_.Write(into));
  spi_.Close();
  EXPECT_FALSE(spi_.IsOpen());
  EXPECT_EQ(spi_.ReadNow(into).status, Status::kLost);
  EXPECT_THAT(ErrorText(spi_.Open()), HasSubstr("axlecast simulate FILE --bus b0"));
  ASSERT_EQ(ErrorText(port_.Plug()), "");
  ASSERT_EQ(Open(spi_), "");
  EXPECT_TRUE(Write(into));
}

TEST_F(SimulatedSpiTest, ASimulatorThatDoesNotAnswerIsLost) {
  const MonoNs before = clock_.Now();
  EXPECT_FALSE(spi_.Write(std::array<std::uint8_t, 1>{}));
  EXPECT_GE(clock_.Now() - before, kSecond);
  spi_.Close();
  port_.Serve();
  ASSERT_EQ(Open(spi_), "");
  ASSERT_TRUE(Write(std::array<std::uint8_t, 1>{}));
  std::array<std::uint8_t, 4> into{};
  EXPECT_EQ(spi_.ReadNow(into).count, 1U) << "the late answer is not taken for this one";
}

TEST_F(SimulatedSpiTest, OneHostAtATime) {
  SimulatedSpi second(path_, {}, clock_);
  EXPECT_THAT(Open(second), ::testing::EndsWith(kLineHeld));
  EXPECT_TRUE(Write(std::array<std::uint8_t, 1>{}));
  spi_.Close();
  EXPECT_EQ(Open(second), "") << "at once, however little the simulator has seen of the first one's end";
}

TEST_F(SimulatedSpiTest, WhoSendsNonsenseIsCutOff) {
  spi_.Close();
  port_.Serve();
  for (const std::size_t size : {1U, 6U, 6U + 265U, 512U, 513U}) {
    SimulatedSocket host;
    ASSERT_EQ(Served(port_, [&] { return ErrorText(host.Connect(path_, "axlecast-spi-1", clock_)); }), "");
    ASSERT_EQ(host.Send(std::vector<std::uint8_t>(size)), FrameLink::SendResult::kQueued);
    port_.Serve();
    std::array<std::uint8_t, 32> answer{};
    EXPECT_EQ(host.Receive(answer).status, Link::Status::kLost) << size;
  }
  EXPECT_TRUE(slave_.settings.empty());
}

}  // namespace
}  // namespace axlecast
