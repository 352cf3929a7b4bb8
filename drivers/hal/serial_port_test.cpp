#include "drivers/hal/serial_port.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>

#include "drivers/hal/pty.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr MonoNs kSoon = 60 * kSecond;  // far beyond what any step here needs

// The other end of the line, behind a link as a simulator has it.
class SerialPortTest : public ::testing::Test {
 protected:
  void SetUp() override {
    link_ = directory_ + "/bus.pty";
    PlugIn();
  }

  void PlugIn() {
    far_ = Descriptor(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    ASSERT_TRUE(far_.valid());
    ASSERT_EQ(grantpt(far_.get()), 0);
    ASSERT_EQ(unlockpt(far_.get()), 0);
    std::filesystem::remove(link_);
    std::filesystem::create_symlink(ptsname(far_.get()), link_);
  }
  void Unplug() { far_.Reset(); }

  void FarWrites(std::vector<std::uint8_t> bytes) {
    ASSERT_EQ(write(far_.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  std::vector<std::uint8_t> FarReads(std::size_t count) {
    std::vector<std::uint8_t> bytes(count);
    std::size_t size = 0;
    while (size < count) {
      pollfd readable{far_.get(), POLLIN, 0};
      if (poll(&readable, 1, 5000) != 1) break;
      const ssize_t got = read(far_.get(), bytes.data() + size, count - size);
      if (got <= 0) break;
      size += static_cast<std::size_t>(got);
    }
    bytes.resize(size);
    return bytes;
  }
  std::vector<std::uint8_t> PortReads(SerialPort& port, std::size_t count) {
    std::vector<std::uint8_t> all;
    std::array<std::uint8_t, 300> buffer;
    while (all.size() < count) {
      const auto result = port.Read(buffer, clock_.Now() + kSoon);
      if (result.status != ByteLink::Status::kOk) break;
      all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(result.count));
    }
    return all;
  }

  SerialSettings Settings() const {
    return {.path = link_, .format = {.baud = 2'500'000}, .pty = {.foreign = true}};
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string link_;
  Descriptor far_;
};

TEST_F(SerialPortTest, CarriesEveryByteValueUnchangedBothWays) {
  SerialPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(port.Write(all));
  EXPECT_EQ(FarReads(256), all);
  FarWrites(all);
  EXPECT_EQ(PortReads(port, 256), all);
  EXPECT_THAT(port.warnings(), IsEmpty());
}

TEST_F(SerialPortTest, ReadEndsAtItsDeadlineAndReadNowAtOnce) {
  SerialPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  std::array<std::uint8_t, 8> buffer;
  EXPECT_EQ(port.ReadNow(buffer).status, ByteLink::Status::kTimeout);
  const MonoNs deadline = clock_.Now() + 2 * kMillisecond;
  EXPECT_EQ(port.Read(buffer, deadline).status, ByteLink::Status::kTimeout);
  EXPECT_GE(clock_.Now(), deadline);
  EXPECT_EQ(port.Read(buffer, deadline).status, ByteLink::Status::kTimeout) << "a deadline in the past";
}

// Reads that follow closely wait in the call itself (call_timer.h).
TEST_F(SerialPortTest, ManyReadsInARowDeliverEachByteAndEndAtTheirDeadline) {
  SerialPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  std::thread device([this] {
    for (int i = 0; i < 200; ++i) FarWrites(FarReads(1));
  });
  std::array<std::uint8_t, 8> buffer;
  for (int i = 0; i < 200; ++i) {
    const auto sent = static_cast<std::uint8_t>(i);
    ASSERT_TRUE(port.Write(std::array{sent}));
    EXPECT_THAT(PortReads(port, 1), ElementsAre(sent));
  }
  device.join();
  for (const MonoNs wait : {2 * kMillisecond, kMillisecond, 100 * kMicrosecond, MonoNs{0}}) {
    const MonoNs deadline = clock_.Now() + wait;
    EXPECT_EQ(port.Read(buffer, deadline).status, ByteLink::Status::kTimeout);
    EXPECT_GE(clock_.Now(), deadline);
  }
}

TEST_F(SerialPortTest, AHangUpEndsARead) {
  for (const int reads_before : {0, 3}) {
    SerialPort port(Settings(), clock_);
    ASSERT_EQ(ErrorText(port.Open()), "");
    for (int i = 0; i < reads_before; ++i) {
      FarWrites({9});
      ASSERT_THAT(PortReads(port, 1), ElementsAre(9));
    }
    std::thread unplugger([this] { Unplug(); });
    std::array<std::uint8_t, 8> buffer;
    EXPECT_EQ(port.Read(buffer, clock_.Now() + kSoon).status, ByteLink::Status::kLost);
    unplugger.join();
    PlugIn();
  }
}

TEST_F(SerialPortTest, WhatCameBeforeOpenIsDiscarded) {
  SerialPort first(Settings(), clock_);
  ASSERT_EQ(ErrorText(first.Open()), "");
  FarWrites({1, 2, 3});
  ASSERT_EQ(first.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  ASSERT_EQ(ErrorText(first.Open()), "");
  FarWrites({4});
  EXPECT_THAT(PortReads(first, 1), ElementsAre(4));
}

TEST_F(SerialPortTest, WaitTellsBytesFromWakeFromTime) {
  SerialPort port(Settings(), clock_);
  EXPECT_EQ(port.Wait(clock_.Now()), ByteLink::Status::kTimeout) << "works on a closed line too";
  std::thread waker([&] { port.Wake(); });
  EXPECT_EQ(port.Wait(kNever), ByteLink::Status::kWoken);
  waker.join();
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_EQ(port.Wait(clock_.Now()), ByteLink::Status::kTimeout) << "a wake counts once";
  FarWrites({7});
  EXPECT_EQ(port.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  EXPECT_THAT(PortReads(port, 1), ElementsAre(7)) << "Wait leaves the bytes where they are";
}

TEST_F(SerialPortTest, ASecondUserIsRefused) {
  SerialPort first(Settings(), clock_);
  SerialPort second(Settings(), clock_);
  ASSERT_EQ(ErrorText(first.Open()), "");
  EXPECT_THAT(ErrorText(second.Open()),
              HasSubstr("another process holds it: end it (is a second driver running?)"));
  EXPECT_FALSE(second.IsOpen());
  first.Close();
  EXPECT_EQ(ErrorText(second.Open()), "");
}

TEST_F(SerialPortTest, AHangUpIsLostAndTheSamePathComesBackByOpening) {
  SerialPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  FarWrites({9});
  ASSERT_THAT(PortReads(port, 1), ElementsAre(9));
  Unplug();
  std::array<std::uint8_t, 8> buffer;
  EXPECT_EQ(port.Read(buffer, clock_.Now() + kSoon).status, ByteLink::Status::kLost);
  EXPECT_EQ(port.ReadNow(buffer).status, ByteLink::Status::kLost);
  EXPECT_FALSE(port.Write(std::array<std::uint8_t, 1>{1}));
  port.Close();
  EXPECT_NE(ErrorText(port.Open()), "");

  PlugIn();
  EXPECT_EQ(ErrorText(port.Open()), "");
  FarWrites({10});
  EXPECT_THAT(PortReads(port, 1), ElementsAre(10));
}

// Two seconds pass at every look.
class HastyClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return now_ += 2 * kSecond; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return 0; }

 private:
  mutable MonoNs now_ = 0;
};

TEST_F(SerialPortTest, AFarEndThatTakesNothingIsLost) {
  HastyClock clock;
  SerialPort port(Settings(), clock);
  ASSERT_EQ(ErrorText(port.Open()), "");
  const std::vector<std::uint8_t> much(1 << 20);
  EXPECT_FALSE(port.Write(much));
}

TEST_F(SerialPortTest, ClosedPortsAreLost) {
  SerialPort port(Settings(), clock_);
  std::array<std::uint8_t, 8> buffer;
  EXPECT_EQ(port.Read(buffer, kNever).status, ByteLink::Status::kLost);
  EXPECT_EQ(port.ReadNow(buffer).status, ByteLink::Status::kLost);
  EXPECT_FALSE(port.Write(std::array<std::uint8_t, 1>{1}));
  EXPECT_EQ(port.Errors().framing, 0);
}

TEST_F(SerialPortTest, OpenNamesCauseAndRemedy) {
  SerialSettings settings = Settings();
  settings.path = directory_ + "/nothing";
  EXPECT_THAT(ErrorText(SerialPort(settings, clock_).Open()),
              HasSubstr("/nothing does not exist: plug the adapter in"));
  EXPECT_THAT(ErrorText(SerialPort(settings, clock_).Open()), HasSubstr("/dev/serial/by-id/"));
  settings.path = "/dev/null";
  EXPECT_THAT(ErrorText(SerialPort(settings, clock_).Open()), HasSubstr("is no serial port"));
  settings.path = directory_;
  EXPECT_NE(ErrorText(SerialPort(settings, clock_).Open()), "");
  settings.path = directory_ + "/file";
  Descriptor(open(settings.path.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600));
  EXPECT_THAT(ErrorText(SerialPort(settings, clock_).Open()), HasSubstr("is no serial port"));
}

TEST_F(SerialPortTest, OpensWithEveryCharacterFormat) {
  for (const auto parity : {Parity::kNone, Parity::kEven, Parity::kOdd}) {
    for (const int stop_bits : {1, 2}) {
      SerialSettings settings = Settings();
      settings.format = {.baud = 9'600, .parity = parity, .stop_bits = stop_bits};
      EXPECT_EQ(ErrorText(SerialPort(settings, clock_).Open()), "");
    }
  }
}

// At the other end, the kernel returns the rate of this end.
TEST_F(SerialPortTest, GoesOnAtAnotherRateAndKeepsWhatHasCome) {
  const std::string path = directory_ + "/other.pty";
  Pty far;
  ASSERT_EQ(ErrorText(far.Open(path)), "");
  SerialSettings settings = Settings();
  settings.path = path;
  SerialPort port(settings, clock_);
  EXPECT_FALSE(port.SetBaud(9'600)) << "closed";
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_EQ(far.Baud(), 2'500'000);
  ASSERT_TRUE(far.Write(std::array<std::uint8_t, 2>{1, 2}));
  ASSERT_EQ(port.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  ASSERT_TRUE(port.SetBaud(19'200));
  EXPECT_EQ(far.Baud(), 19'200);
  EXPECT_THAT(PortReads(port, 2), ElementsAre(1, 2));
  ASSERT_TRUE(port.SetBaud(31'250)) << "not one of the rates with a name";
  EXPECT_EQ(far.Baud(), 31'250);
  EXPECT_FALSE(port.SetBaud(0));
  EXPECT_TRUE(far.HasHost()) << "never closed meanwhile";
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_EQ(far.Baud(), 2'500'000) << "an opened port begins with the settings";
  far.Close();
  EXPECT_FALSE(port.SetBaud(9'600)) << "the line is gone";
}

}  // namespace
}  // namespace axlecast
