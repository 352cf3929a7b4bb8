#include "drivers/hal/modbus_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/hal/pty.h"
#include "drivers/hal/serial_port.h"
#include "platform/os/system_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Wire = std::vector<std::uint8_t>;

constexpr MonoNs kSoon = 60 * kSecond;  // far beyond what any step here needs

// From the address to the CRC, reckoned bit by bit outside this project (Modbus over Serial Line V1.02, 6.2.2).
const Wire kReadTen = {0x01, 0x03, 0x00, 0x00, 0x00, 0x0A, 0xC5, 0xCD};
const Wire kReadCoils = {0x11, 0x01, 0x00, 0x13, 0x00, 0x25, 0x0E, 0x84};

class ModbusPortTest : public ::testing::Test {
 protected:
  ModbusPortTest() {
    path_ = directory_ + "/bus.pty";
    EXPECT_EQ(ErrorText(far_.Open(path_)), "");
  }

  [[nodiscard]] SerialSettings Settings() const { return {.path = path_, .format = {.baud = 9'600}}; }

  Wire FarReads(std::size_t count) {
    Wire bytes(count);
    std::size_t size = 0;
    while (size < count) {
      pollfd readable{far_.FileDescriptor(), POLLIN, 0};
      if (poll(&readable, 1, 5'000) != 1) break;
      const std::size_t got = far_.Read(std::span(bytes).subspan(size));
      if (got == 0) break;
      size += got;
    }
    bytes.resize(size);
    return bytes;
  }
  Wire PortReads(ModbusPort& port, std::size_t count) {
    Wire all;
    std::array<std::uint8_t, 300> buffer;
    while (all.size() < count) {
      const auto result = port.Read(buffer, clock_.Now() + kSoon);
      if (result.status != ByteLink::Status::kOk) break;
      all.insert(all.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(result.count));
    }
    return all;
  }

  SystemClock clock_;
  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
  std::string path_;
  Pty far_;
};

TEST_F(ModbusPortTest, FramesOfEveryAddressAndFunctionGoOutAsTheyAre) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_TRUE(port.IsOpen());
  EXPECT_THAT(port.warnings(), IsEmpty());
  const Wire broadcast = {0x00, 0x06, 0x00, 0x01, 0x00, 0x03, 0x99, 0xDA};
  const Wire address_255 = {0xFF, 0x03, 0x00, 0x00, 0x00, 0x01, 0x91, 0xD4};
  const Wire server_id = {0x01, 0x11, 0xC0, 0x2C};
  const Wire function_c1 = {0x01, 0xC1, 0xC1, 0xB0};
  for (const Wire& frame : {kReadTen, kReadCoils, broadcast, address_255, server_id, function_c1}) {
    EXPECT_TRUE(port.Write(frame));
    EXPECT_EQ(FarReads(frame.size()), frame);
  }
}

TEST_F(ModbusPortTest, AFrameWithoutItsCrcDoesNotGoOut) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  Wire wrong = kReadTen;
  wrong.back() ^= 1;
  EXPECT_FALSE(port.Write(wrong));
  EXPECT_FALSE(port.Write({}));
  EXPECT_FALSE(port.Write(Wire{0x01}));
  EXPECT_FALSE(port.Write(Wire{0x7E, 0x80}));
  EXPECT_TRUE(port.Write(kReadTen));
  EXPECT_EQ(FarReads(kReadTen.size()), kReadTen) << "the first on the line";
}

TEST_F(ModbusPortTest, TheLongestFrameIs256Bytes) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  Wire longest(254, 0x00);
  longest.insert(longest.end(), {0x55, 0x4E});
  ASSERT_TRUE(port.Write(longest));
  EXPECT_EQ(FarReads(256), longest);
  Wire longer(255, 0x00);
  longer.insert(longer.end(), {0x8E, 0x3F});
  EXPECT_FALSE(port.Write(longer));
}

TEST_F(ModbusPortTest, HandsOverEveryByteThatComesAskedForOrNot) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  Wire all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  ASSERT_TRUE(far_.Write(all));
  ASSERT_EQ(port.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  ASSERT_TRUE(port.Write(kReadTen)) << "sending drops nothing that came before";
  EXPECT_EQ(PortReads(port, 256), all);
}

TEST_F(ModbusPortTest, NothingThereIsNotTheEndOfTheLine) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  std::array<std::uint8_t, 8> buffer;
  EXPECT_EQ(port.ReadNow(buffer).status, ByteLink::Status::kTimeout);
  EXPECT_EQ(port.Read(buffer, clock_.Now() + kMillisecond).status, ByteLink::Status::kTimeout);
  EXPECT_EQ(port.Wait(clock_.Now()), ByteLink::Status::kTimeout);
  port.Wake();
  EXPECT_EQ(port.Wait(kNever), ByteLink::Status::kWoken);
  far_.Close();
  EXPECT_EQ(port.Read(buffer, clock_.Now() + kSoon).status, ByteLink::Status::kLost);
  EXPECT_EQ(port.ReadNow(buffer).status, ByteLink::Status::kLost);
  EXPECT_FALSE(port.Write(kReadTen));
  EXPECT_FALSE(port.SetBaud(19'200));
  EXPECT_NE(ErrorText(port.Open()), "");
  EXPECT_FALSE(port.IsOpen());
  ASSERT_EQ(ErrorText(far_.Open(path_)), "");
  EXPECT_EQ(ErrorText(port.Open()), "");
  EXPECT_TRUE(port.Write(kReadTen));
  EXPECT_EQ(FarReads(kReadTen.size()), kReadTen);
}

TEST_F(ModbusPortTest, WhatCameBeforeOpenIsDiscarded) {
  ModbusPort port(Settings(), clock_);
  ASSERT_EQ(ErrorText(port.Open()), "");
  ASSERT_TRUE(far_.Write(Wire{1, 2, 3}));
  ASSERT_EQ(port.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  ASSERT_EQ(ErrorText(port.Open()), "");
  ASSERT_TRUE(far_.Write(Wire{4}));
  EXPECT_THAT(PortReads(port, 1), ElementsAre(4));
}

TEST_F(ModbusPortTest, OneUserWhicheverPort) {
  ModbusPort first(Settings(), clock_);
  ModbusPort second(Settings(), clock_);
  SerialPort third(Settings(), clock_);
  ASSERT_EQ(ErrorText(first.Open()), "");
  EXPECT_THAT(ErrorText(second.Open()),
              HasSubstr("another process holds it: end it (is a second driver running?)"));
  EXPECT_THAT(ErrorText(third.Open()), HasSubstr("another process holds it"));
  ASSERT_TRUE(first.SetBaud(19'200));
  EXPECT_THAT(ErrorText(second.Open()), HasSubstr("another process holds it")) << "after a change of rate too";
  first.Close();
  EXPECT_EQ(ErrorText(second.Open()), "");
}

// Each is set by libmodbus and read back at the other end; any other rate would silently be 9600.
TEST_F(ModbusPortTest, EveryRateThatItTakesIsMade) {
  for (const std::int64_t baud :
       {1'200,     9'600,     19'200,  38'400,    57'600,    115'200,   230'400,   460'800,
        500'000,   576'000,   921'600, 1'000'000, 1'152'000, 1'500'000, 2'500'000, 3'000'000,
        3'500'000, 4'000'000, 110,     300,       600,       2'400,     4'800}) {
    SerialSettings settings = Settings();
    settings.format.baud = baud;
    ModbusPort port(settings, clock_);
    EXPECT_EQ(ErrorText(port.Open()), "");
    EXPECT_EQ(far_.Baud(), baud);
  }
  for (const std::int64_t baud : {0, 1, 9'601, 14'400, 128'000, 250'000, 2'000'000}) {
    SerialSettings settings = Settings();
    settings.format.baud = baud;
    ModbusPort port(settings, clock_);
    EXPECT_THAT(ErrorText(port.Open()),
                HasSubstr("link.baud " + std::to_string(baud) + " is no rate of the Modbus library"));
    EXPECT_FALSE(port.IsOpen());
  }
}

TEST_F(ModbusPortTest, GoesOnAtAnotherRateAndKeepsWhatHasCome) {
  ModbusPort port(Settings(), clock_);
  EXPECT_FALSE(port.SetBaud(19'200)) << "closed";
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_EQ(far_.Baud(), 9'600);
  ASSERT_TRUE(far_.Write(Wire{1, 2}));
  ASSERT_EQ(port.Wait(clock_.Now() + kSoon), ByteLink::Status::kOk);
  ASSERT_TRUE(port.SetBaud(115'200));
  EXPECT_EQ(far_.Baud(), 115'200);
  EXPECT_TRUE(far_.HasHost());
  EXPECT_THAT(PortReads(port, 2), ElementsAre(1, 2));
  ASSERT_TRUE(port.Write(kReadTen));
  EXPECT_EQ(FarReads(kReadTen.size()), kReadTen);
  EXPECT_FALSE(port.SetBaud(12'345)) << "libmodbus would make 9600 of it";
  EXPECT_EQ(far_.Baud(), 115'200);
  ASSERT_EQ(ErrorText(port.Open()), "");
  EXPECT_EQ(far_.Baud(), 9'600) << "an opened port begins with the settings";
}

TEST_F(ModbusPortTest, APtyCarriesEveryFormatWithoutParity) {
  for (const auto parity : {Parity::kNone, Parity::kEven, Parity::kOdd}) {
    for (const int stop_bits : {1, 2}) {
      SerialSettings settings = Settings();
      settings.format = {.baud = 19'200, .parity = parity, .stop_bits = stop_bits};
      EXPECT_EQ(ErrorText(ModbusPort(settings, clock_).Open()), "");
    }
  }
}

TEST_F(ModbusPortTest, OpenNamesCauseAndRemedy) {
  SerialSettings settings = Settings();
  settings.path = directory_ + "/nothing";
  EXPECT_THAT(ErrorText(ModbusPort(settings, clock_).Open()),
              HasSubstr("/nothing does not exist: plug the adapter in"));
  settings.path = "/dev/null";
  EXPECT_THAT(ErrorText(ModbusPort(settings, clock_).Open()), HasSubstr("is no serial port"));
  settings.path = "";
  EXPECT_NE(ErrorText(ModbusPort(settings, clock_).Open()), "");
}

// Two seconds pass at every look.
class HastyClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return now_ += 2 * kSecond; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return 0; }

 private:
  mutable MonoNs now_ = 0;
};

TEST_F(ModbusPortTest, AFarEndThatTakesNothingIsLost) {
  HastyClock clock;
  ModbusPort port(Settings(), clock);
  ASSERT_EQ(ErrorText(port.Open()), "");
  int taken = 0;
  while (taken < 1'000'000 && port.Write(kReadTen)) ++taken;
  EXPECT_LT(taken, 1'000'000);
}

}  // namespace
}  // namespace axlecast
