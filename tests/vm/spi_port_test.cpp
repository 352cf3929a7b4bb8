#include "drivers/hal/spi_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/device/link.h"
#include "drivers/hal/simulated_spi.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Status = Link::Status;

constexpr const char* kName = "spidev8.1";
constexpr MonoNs kPatience = 20 * kSecond;

// Sends the complement of what is clocked out.
class Complement final : public Simulator {
 public:
  struct Seen {
    SpiSettings settings;
    int bits_per_word = 0;
    std::vector<std::uint8_t> tx;
    MonoNs at = 0;
  };

  void OnTransfer(const SpiTransfer& transfer, MonoNs now, std::span<std::uint8_t> rx) override {
    const std::lock_guard lock(mutex_);
    seen_.push_back({transfer.settings, transfer.bits_per_word, {transfer.tx.begin(), transfer.tx.end()}, now});
    for (std::size_t i = 0; i < rx.size(); ++i) rx[i] = static_cast<std::uint8_t>(~transfer.tx[i]);
  }
  [[nodiscard]] MonoNs NextDue() const override { return kNever; }
  void OnDue(MonoNs, const Transmit&) override {}
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  [[nodiscard]] std::vector<Seen> seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<Seen> seen_;
};

// A simulated bus, served by a thread while it is there.
class ServedBus {
 public:
  ServedBus(const std::string& path, const Clock& clock) : port_(path, device_, clock) {
    EXPECT_EQ(ErrorText(port_.Plug()), "");
    thread_ = std::thread([this] {
      std::array<pollfd, 2> files{{{port_.FileDescriptor(), POLLIN, 0}, {stop_.get(), POLLIN, 0}}};
      while (poll(files.data(), files.size(), -1) > 0 && files[1].revents == 0) port_.Serve();
    });
  }
  ~ServedBus() {
    const std::uint64_t one = 1;
    EXPECT_EQ(write(stop_.get(), &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread_.join();
  }
  ServedBus(const ServedBus&) = delete;
  ServedBus& operator=(const ServedBus&) = delete;

  [[nodiscard]] std::vector<Complement::Seen> seen() const { return device_.seen(); }

 private:
  Complement device_;
  SimulatedSpiPort port_;
  const Descriptor stop_{eventfd(0, EFD_CLOEXEC)};
  std::thread thread_;
};

// /dev/spidev8.1, a real device file whose transfers go to the simulated bus: the program beside this one.
class CuseSpidev {
 public:
  explicit CuseSpidev(const std::string& socket) {
    const std::string program =
        (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "cuse_spidev").string();
    process_ = fork();
    if (process_ == 0) {
      execl(program.c_str(), program.c_str(), kName, socket.c_str(), nullptr);
      _exit(127);
    }
  }
  ~CuseSpidev() {
    EXPECT_EQ(kill(process_, SIGTERM), 0);
    EXPECT_EQ(waitpid(process_, nullptr, 0), process_);
  }
  CuseSpidev(const CuseSpidev&) = delete;
  CuseSpidev& operator=(const CuseSpidev&) = delete;

 private:
  pid_t process_ = -1;
};

class SpiPortOnADevice : public ::testing::Test {
 protected:
  void SetUp() override {
    SpiPort port = Port();
    const MonoNs give_up = clock_.Now() + kPatience;
    while (!port.Open() && clock_.Now() < give_up) {
      static_cast<void>(PollUntil({}, clock_.Now() + 10 * kMillisecond, clock_));
    }
    ASSERT_TRUE(port.IsOpen()) << ErrorText(port.Open());
  }

  [[nodiscard]] SpiPort Port(SpiSettings settings = {.mode = 2, .clock_hz = 400'000}) const {
    return {path_, settings, clock_};
  }

  SystemClock clock_;
  TemporaryFolder folder_;
  const std::string socket_ = folder_.path() + "/bus.spi";
  const std::string path_ = std::string("/dev/") + kName;
  std::optional<ServedBus> bus_{std::in_place, socket_, clock_};
  CuseSpidev device_{socket_};
};

TEST_F(SpiPortOnADevice, ATransferReachesTheDeviceAsItWasAskedForAndBringsWhatItSends) {
  SpiPort port = Port();
  ASSERT_EQ(ErrorText(port.Open()), "");
  const std::array<std::uint8_t, 4> out{0x00, 0xFF, 0x55, 0x01};
  std::array<std::uint8_t, 8> in{};
  EXPECT_EQ(port.ReadNow(in).status, Status::kTimeout);
  const MonoNs before = clock_.Now();
  ASSERT_TRUE(port.Write(out));
  const MonoNs after = clock_.Now();
  EXPECT_EQ(port.Wait(after + kSecond), Status::kOk);
  const ByteLink::ReadResult read = port.Read(in, after);
  EXPECT_EQ(read.status, Status::kOk);
  ASSERT_EQ(read.count, 4U);
  EXPECT_THAT(std::span(in).first(4), ElementsAre(0xFF, 0x00, 0xAA, 0xFE));

  const auto seen = bus_->seen();
  ASSERT_EQ(seen.size(), 1U) << "one message, not one for each byte";
  EXPECT_EQ(seen[0].settings, (SpiSettings{.mode = 2, .clock_hz = 400'000}));
  EXPECT_EQ(seen[0].bits_per_word, 8);
  EXPECT_THAT(seen[0].tx, ElementsAre(0x00, 0xFF, 0x55, 0x01));
  EXPECT_GE(seen[0].at, before) << "the first clock edge lies within the write";
  EXPECT_LE(seen[0].at, after - SpiSettings{.clock_hz = 400'000}.ClockTime(32));
}

TEST_F(SpiPortOnADevice, EveryModeAndClockIsSet) {
  for (const int mode : {0, 1, 2, 3}) {
    const SpiSettings settings{.mode = mode, .clock_hz = 100'000 + mode};
    SpiPort port = Port(settings);
    ASSERT_EQ(ErrorText(port.Open()), "");
    ASSERT_TRUE(port.Write(std::array<std::uint8_t, 1>{}));
    EXPECT_EQ(bus_->seen().back().settings, settings);
  }
}

TEST_F(SpiPortOnADevice, TheLongestFrameIsOneTransfer) {
  SpiPort port = Port({.mode = 0, .clock_hz = 5'000'000});
  ASSERT_EQ(ErrorText(port.Open()), "");
  ASSERT_TRUE(port.Write(std::vector<std::uint8_t>(kMaxFrame, 0x0F)));
  std::array<std::uint8_t, kMaxFrame> in{};
  ASSERT_EQ(port.ReadNow(in).count, kMaxFrame);
  EXPECT_THAT(in, ::testing::Each(0xF0));
  EXPECT_FALSE(port.Write(std::vector<std::uint8_t>(kMaxFrame + 1)));
  EXPECT_EQ(bus_->seen().size(), 1U);
}

TEST_F(SpiPortOnADevice, WhatTheControllerCannotDoIsNamed) {
  EXPECT_THAT(ErrorText(Port({.mode = 8, .clock_hz = 400'000}).Open()), HasSubstr("cannot do SPI mode 8"));
  EXPECT_THAT(ErrorText(Port({.mode = 2, .clock_hz = 0}).Open()),
              HasSubstr("cannot be clocked at 0 Hz: set link.clock_hz"));
}

TEST_F(SpiPortOnADevice, OneDriverPerDevice) {
  SpiPort first = Port();
  ASSERT_EQ(ErrorText(first.Open()), "");
  SpiPort second = Port();
  EXPECT_THAT(ErrorText(second.Open()), ::testing::EndsWith(kLineHeld));
  first.Close();
  EXPECT_EQ(ErrorText(second.Open()), "");
}

TEST_F(SpiPortOnADevice, WithoutRightsTheGroupIsNamed) {
  SpiPort port = Port();
  ASSERT_EQ(geteuid(), 0U) << "the guest's user";
  ASSERT_EQ(seteuid(65'534), 0);
  const std::string problem = ErrorText(port.Open());
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_THAT(problem, HasSubstr("usermod -aG spi USER"));
}

TEST_F(SpiPortOnADevice, ATransferThatFailsIsALostLine) {
  SpiPort port = Port();
  ASSERT_EQ(ErrorText(port.Open()), "");
  bus_.reset();
  const std::array<std::uint8_t, 4> out{};
  std::array<std::uint8_t, 4> in{};
  EXPECT_FALSE(port.Write(out));
  EXPECT_EQ(port.ReadNow(in).status, Status::kTimeout) << "nothing of it is handed out";
  port.Close();
  bus_.emplace(socket_, clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_TRUE(port.Write(out));
  EXPECT_EQ(port.ReadNow(in).count, 4U);
}

}  // namespace
}  // namespace axlecast
