#include "tests/support/simulator_spi_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using Status = Link::Status;

class Slave final : public Simulator {
 public:
  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override {
    settings = transfer.settings;
    first_edge = now;
    std::fill(rx.begin(), rx.end(), std::uint8_t{0x11});
  }
  [[nodiscard]] MonoNs NextDue() const override { return due; }
  void OnDue(MonoNs now, const Transmit&) override {
    ran_at = now;
    due = kNever;
  }
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  SpiSettings settings;
  MonoNs first_edge = 0;
  MonoNs due = kNever;
  MonoNs ran_at = 0;
};

class SimulatorSpiLinkTest : public ::testing::Test {
 protected:
  SimulatorSpiLinkTest() { EXPECT_EQ(ErrorText(link_.Open()), ""); }

  [[nodiscard]] std::vector<std::uint8_t> Clocked(std::size_t bytes) {
    EXPECT_TRUE(link_.Write(std::vector<std::uint8_t>(bytes)));
    std::array<std::uint8_t, 16> in{};
    const std::size_t count = link_.Read(in, clock_.Now()).count;
    return {in.begin(), in.begin() + static_cast<std::ptrdiff_t>(count)};
  }

  FakeClock clock_;
  Slave slave_;
  SimulatorSpiLink link_{clock_, slave_, {.mode = 2, .clock_hz = 100'000}};
};

TEST_F(SimulatorSpiLinkTest, ATransferTakesTheTimeOfItsClocks) {
  const MonoNs begin = clock_.Now();
  EXPECT_EQ(Clocked(3), std::vector<std::uint8_t>(3, 0x11));
  EXPECT_EQ(clock_.Now() - begin, 240 * kMicrosecond);
  EXPECT_EQ(slave_.first_edge, begin);
  EXPECT_EQ(slave_.settings, (SpiSettings{.mode = 2, .clock_hz = 100'000}));
  EXPECT_EQ(link_.writes(), 1);
}

TEST_F(SimulatorSpiLinkTest, WhatIsDueInTheSimulatorHappensInItsTime) {
  const MonoNs begin = clock_.Now();
  slave_.due = begin + kSecond;
  EXPECT_EQ(link_.Wait(begin + 3 * kSecond), Status::kTimeout);
  EXPECT_EQ(slave_.ran_at, begin + kSecond);
  EXPECT_EQ(clock_.Now(), begin + 3 * kSecond);
  EXPECT_EQ(link_.waits(), 1);
  slave_.due = begin;
  EXPECT_EQ(Clocked(1).size(), 1U);
  EXPECT_EQ(slave_.ran_at, begin + 3 * kSecond) << "what is overdue, before the transfer";
}

TEST_F(SimulatorSpiLinkTest, DamageChangesWhatIsClockedIn) {
  link_.SetDamage([](std::vector<std::uint8_t>& bytes) { bytes[0] = 0x22; });
  EXPECT_EQ(Clocked(2), (std::vector<std::uint8_t>{0x22, 0x11}));
  link_.SetDamage([](std::vector<std::uint8_t>& bytes) { bytes.clear(); });
  EXPECT_EQ(Clocked(2), (std::vector<std::uint8_t>{0xFF, 0xFF})) << "a line that nobody drives rests high";
  link_.SetDamage([](std::vector<std::uint8_t>& bytes) { bytes.resize(9, 0); });
  EXPECT_EQ(Clocked(2).size(), 2U) << "as many as were clocked";
}

TEST_F(SimulatorSpiLinkTest, UnpluggedItIsLost) {
  link_.Unplug();
  EXPECT_FALSE(link_.Write(std::array<std::uint8_t, 1>{}));
  std::array<std::uint8_t, 4> in{};
  EXPECT_EQ(link_.Read(in, clock_.Now()).status, Status::kLost);
  EXPECT_EQ(link_.Wait(clock_.Now() + kSecond), Status::kLost);
  link_.Close();
  EXPECT_NE(ErrorText(link_.Open()), "");
  link_.Plug();
  EXPECT_EQ(ErrorText(link_.Open()), "");
  EXPECT_EQ(Clocked(1).size(), 1U);
}

}  // namespace
}  // namespace axlecast
