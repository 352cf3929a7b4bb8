// Commands and responses of one unit against the communication guideline: data address list (7), error codes with
// their discovery priority (5), block-only addresses (7, note 1), password (6, note 1; 11).
#include "drivers/tsubaki_sc/simulator/sc_unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tests/support/golden_file.h"

namespace axlecast::tsubaki_sc::simulator {
namespace {

using testing::ElementsAre;
using testing::ElementsAreArray;
using ByteList = std::vector<std::uint8_t>;

constexpr std::uint8_t kFunctionError = 1;
constexpr std::uint8_t kAddressError = 2;
constexpr std::uint8_t kDataError = 3;
constexpr std::uint8_t kLoginError = 4;

class UnitRequestTest : public testing::Test {
 protected:
  UnitRequestTest() { unit_.Advance(0); }

  ByteList Ask(const ByteList& command) { return Execute(unit_, command); }
  ByteList Hex(const std::string& command) { return Execute(unit_, GoldenBytes(command)); }
  ByteList Read(std::uint8_t function, unsigned start, unsigned count) {
    return Ask({function, Byte(start >> 8U), Byte(start), Byte(count >> 8U), Byte(count)});
  }
  // The values of a register read; nothing when it was refused.
  std::vector<unsigned> Registers(std::uint8_t function, unsigned start, unsigned count) {
    const ByteList response = Read(function, start, count);
    std::vector<unsigned> values;
    if (response[0] != function || response[1] != 2 * count) return values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(response[2 + 2 * i] * 256U + response[3 + 2 * i]);
    return values;
  }
  // 16 characters in eight registers from `start` on.
  ByteList WriteText(unsigned start, std::string text, char padding = '\0') {
    text.resize(16, padding);
    ByteList command = {0x10, Byte(start >> 8U), Byte(start), 0, 8, 16};
    for (const char character : text) command.push_back(static_cast<std::uint8_t>(character));
    return Ask(command);
  }
  void LogIn() { ASSERT_THAT(WriteText(100, "password"), ElementsAre(0x10, 0, 100, 0, 8)); }
  static std::uint8_t Byte(unsigned value) { return static_cast<std::uint8_t>(value); }
  // The error code that is answered; 0: none.
  static unsigned Error(const ByteList& response) { return (response[0] & 0x80U) != 0 ? response[1] : 0U; }

  ScUnit unit_{1};
};

// SAA manual 5.1.7 prints these commands with their CRC; the calculation is the same (guideline 4).
TEST_F(UnitRequestTest, ErrorCheckOfPrintedFrames) {
  EXPECT_EQ(ErrorCheck(GoldenBytes("01 03 00 00 00 01")), 0x0A84);
  EXPECT_EQ(ErrorCheck(GoldenBytes("01 03 00 00 00 02")), 0x0BC4);
}

// Guideline 7, copied by hand: what exists is answered, every other address of the space is error 02.
TEST_F(UnitRequestTest, ExactlyTheListedAddressesExist) {
  std::set<unsigned> input = {300};
  for (unsigned a = 0; a <= 8; ++a) input.insert(a);
  for (unsigned a = 100; a <= 106; ++a) input.insert(a);
  for (unsigned a = 200; a <= 204; ++a) input.insert(a);
  for (unsigned log = 1000; log <= 3000; log += 1000) {
    for (unsigned quantity = 0; quantity <= 600; quantity += 100) {
      for (unsigned a = 0; a <= 19; ++a) input.insert(log + quantity + a);
    }
  }
  EXPECT_EQ(input.size(), 9U + 7 + 5 + 1 + 3 * 7 * 20);
  for (unsigned a = 0; a < 65'536; ++a) {
    EXPECT_EQ(Error(Read(0x04, a, 1)), input.contains(a) ? 0 : kAddressError) << a;
    EXPECT_EQ(Error(Read(0x01, a, 1)), a == 0 || a == 100 || a == 200 ? 0 : kAddressError) << a;
    EXPECT_EQ(Error(Read(0x02, a, 1)), a == 0 ? 0 : kAddressError) << a;
    const bool whole_only =
        (a >= 100 && a <= 107) || (a >= 200 && a <= 207) || a == 300 || a == 301 || (a >= 350 && a <= 354);
    EXPECT_EQ(Error(Read(0x03, a, 1)), a <= 54 ? 0 : whole_only ? kDataError : kAddressError) << a;
  }
}

TEST_F(UnitRequestTest, GapsAreNeverBridged) {
  EXPECT_EQ(Registers(0x03, 0, 55).size(), 55U);
  EXPECT_EQ(Registers(0x04, 100, 7).size(), 7U);
  for (const auto& [function, start, count] : std::vector<std::array<unsigned, 3>>{{0x03, 0, 56},
                                                                                   {0x03, 54, 2},
                                                                                   {0x03, 0, 101},
                                                                                   {0x04, 0, 10},
                                                                                   {0x04, 99, 2},
                                                                                   {0x04, 100, 8},
                                                                                   {0x04, 106, 95},
                                                                                   {0x04, 1000, 21},
                                                                                   {0x04, 1019, 82},
                                                                                   {0x04, 0xFFFF, 2},
                                                                                   {0x01, 0, 2},
                                                                                   {0x01, 100, 101},
                                                                                   {0x02, 0, 2}}) {
    EXPECT_EQ(Error(Read(Byte(function), start, count)), kAddressError) << function << ' ' << start << ' ' << count;
  }
}

// Guideline 7, note 1: "Write and read data with address consecutive specify".
TEST_F(UnitRequestTest, SomeBlocksOnlyAsAWhole) {
  LogIn();
  for (const auto& [first, size] :
       std::vector<std::pair<unsigned, unsigned>>{{100, 8}, {200, 8}, {300, 2}, {350, 5}}) {
    EXPECT_EQ(Registers(0x03, first, size).size(), size);
    for (unsigned start = first; start < first + size; ++start) {
      for (unsigned count = 1; count < size && start + count <= first + size; ++count) {
        EXPECT_EQ(Error(Read(0x03, start, count)), kDataError) << start << ' ' << count;
      }
    }
    EXPECT_EQ(Error(Read(0x03, first, size + 1)), kAddressError);
  }
  EXPECT_EQ(Error(Hex("06 00 64 70 61")), kDataError);
  EXPECT_EQ(Error(Hex("06 00 C8 70 61")), kDataError);
  EXPECT_EQ(Error(Hex("10 00 64 00 01 02 70 61")), kDataError);
}

TEST_F(UnitRequestTest, IdentityCanOnlyBeRead) {
  unit_.settings.product_code = "AB12";
  unit_.settings.mfg_number = "0123456789";
  EXPECT_THAT(Hex("03 01 2C 00 02"), ElementsAre(0x03, 4, 'A', 'B', '1', '2'));
  EXPECT_THAT(Hex("03 01 5E 00 05"), ElementsAre(0x03, 10, '0', '1', '2', '3', '4', '5', '6', '7', '8', '9'));
  LogIn();
  EXPECT_EQ(Error(Hex("10 01 2C 00 02 04 41 42 31 32")), kAddressError);
  EXPECT_EQ(Error(Hex("06 01 5E 30 31")), kAddressError);
}

// Guideline 12: without a byte count; the example is Ver.1.0.0.
TEST_F(UnitRequestTest, SlaveInformationHasNoByteCount) {
  EXPECT_THAT(Hex("11"), ElementsAre(0x11, 0x01, 0x00));
  EXPECT_EQ(Error(Hex("11 00")), kDataError);
}

// Guideline 5, each code alone.
TEST_F(UnitRequestTest, ErrorCodes) {
  for (unsigned function = 0; function < 256; ++function) {
    const bool known = (function >= 1 && function <= 6) || function == 0x0F || function == 0x10 || function == 0x11;
    const ByteList response = Ask({Byte(function), 0, 0, 0, 1});
    if (known) continue;
    EXPECT_THAT(response, ElementsAre(Byte(function | 0x80U), kFunctionError)) << function;
  }
  LogIn();
  EXPECT_EQ(Error(Hex("04 00 00 00 00")), kDataError) << "no register";
  EXPECT_EQ(Error(Hex("04 00 00 00 01 00")), kDataError) << "a byte too many";
  EXPECT_EQ(Error(Hex("04 00")), kDataError) << "no whole command";
  EXPECT_EQ(Error(Hex("05 00 64 00 01")), kDataError) << "neither FF00 nor 0000";
  EXPECT_EQ(Error(Hex("05 00 64 FF FF")), kDataError);
  EXPECT_EQ(Error(Hex("10 00 34 00 01 04 00 00 00 00")), kDataError) << "bytes of two registers";
  EXPECT_EQ(Error(Hex("10 00 34 00 02 04 00 00")), kDataError) << "bytes missing";
  EXPECT_EQ(Error(Hex("0F 00 64 00 01 02 01 00")), kDataError);
  EXPECT_EQ(Error(WriteText(200, "short67")), kDataError) << "7 characters";
  EXPECT_EQ(Error(WriteText(200, "with blank")), kDataError) << "0x20 inside";
  EXPECT_EQ(Error(WriteText(200, std::string("nul\0inside", 10))), kDataError);
  EXPECT_EQ(Error(WriteText(100, "short67")), kDataError);
  EXPECT_EQ(Error(WriteText(100, "")), kDataError);
  EXPECT_EQ(Error(WriteText(100, "wrong-one")), kLoginError);
}

// Guideline 5, "Discovery Priority": of all that is wrong the lowest number is answered. The unit is logged out.
TEST_F(UnitRequestTest, DiscoveryPriority) {
  EXPECT_EQ(Error(Hex("07 FF FF 00 00")), kFunctionError) << "before address";
  EXPECT_EQ(Error(Hex("7F")), kFunctionError) << "before data";
  EXPECT_EQ(Error(Hex("04 00 09 00 00")), kAddressError) << "before data: no register";
  EXPECT_EQ(Error(Hex("03 00 00 00 7E")), kAddressError) << "before data: 126 registers";
  EXPECT_EQ(Error(Hex("05 00 01 12 34")), kAddressError) << "before data and login";
  EXPECT_EQ(Error(Hex("06 00 37 00 00")), kAddressError) << "before login";
  EXPECT_EQ(Error(Hex("10 00 36 00 02 04 00 00 00 00")), kAddressError) << "before range and login";
  EXPECT_EQ(Error(Hex("05 00 64 12 34")), kDataError) << "before login";
  EXPECT_EQ(Error(Hex("06 00 36 00 00")), kDataError) << "out of range, before login";
  EXPECT_EQ(Error(Read(0x03, 200, 1)), kDataError) << "before login";
  EXPECT_EQ(Error(WriteText(200, "short67")), kDataError) << "before login";
  EXPECT_EQ(Error(Hex("05 00 64 FF 00")), kLoginError);
  EXPECT_EQ(Error(Hex("0F 00 64 00 01 01 01")), kLoginError);
  EXPECT_EQ(Error(Hex("06 00 36 00 0A")), kLoginError);
  EXPECT_EQ(Error(Hex("10 00 36 00 01 02 00 0A")), kLoginError);
  EXPECT_EQ(Error(WriteText(200, "new-password")), kLoginError);
  EXPECT_EQ(Error(Read(0x03, 200, 8)), kLoginError);
  EXPECT_FALSE(unit_.Coil(100));
}

// ---- parameters: guideline 11 ----

TEST_F(UnitRequestTest, EveryParameterTakesItsRangeOnly) {
  LogIn();
  for (unsigned address = 0; address <= 54; ++address) {
    unsigned low = 0;
    unsigned high = 10'000;
    if (address == 8 || address == 21 || address == 34 || address == 47) {
      low = 1;
      high = 50;
    } else if ((address >= 9 && address <= 12) || (address >= 22 && address <= 25) ||
               (address >= 35 && address <= 38) || (address >= 48 && address <= 51)) {
      high = 300;
    } else if (address == 52) {
      high = 1250;
    } else if (address == 53) {
      high = 15'000;
    } else if (address == 54) {
      low = 1;
      high = 100;
    }
    const auto write = [&](unsigned value) {
      return Error(Ask({0x06, 0, Byte(address), Byte(value >> 8U), Byte(value)}));
    };
    EXPECT_EQ(write(low), 0U) << address;
    EXPECT_THAT(Registers(0x03, address, 1), ElementsAre(low)) << address;
    EXPECT_EQ(write(high), 0U) << address;
    EXPECT_EQ(write(high + 1), kDataError) << address;
    if (low > 0) {
      EXPECT_EQ(write(low - 1), kDataError) << address;
    }
    EXPECT_THAT(Registers(0x03, address, 1), ElementsAre(high)) << address;
  }
}

TEST_F(UnitRequestTest, OneValueOutOfRangeWritesNone) {
  LogIn();
  const auto before = Registers(0x03, 52, 3);
  EXPECT_EQ(Error(Hex("10 00 34 00 03 06 00 01 00 02 00 65")), kDataError);
  EXPECT_EQ(Registers(0x03, 52, 3), before);
  EXPECT_THAT(Hex("10 00 34 00 03 06 00 01 00 02 00 64"), ElementsAre(0x10, 0, 52, 0, 3));
  EXPECT_THAT(Registers(0x03, 52, 3), ElementsAre(1, 2, 100));
}

TEST_F(UnitRequestTest, OutOfRangeCanBeKeptOrClampedInstead) {
  LogIn();
  unit_.settings.out_of_range = ScUnit::OutOfRange::kKeep;
  const auto before = Registers(0x03, 54, 1);
  EXPECT_THAT(Hex("06 00 36 01 00"), ElementsAre(0x06, 0, 54, 1, 0));
  EXPECT_EQ(Registers(0x03, 54, 1), before);
  unit_.settings.out_of_range = ScUnit::OutOfRange::kClamp;
  EXPECT_EQ(Error(Hex("06 00 36 01 00")), 0U);
  EXPECT_THAT(Registers(0x03, 54, 1), ElementsAre(100));
}

// Input registers 0-8 show the DIP switch setting and mains frequency in force.
TEST_F(UnitRequestTest, SetParametersFollowDipSwitchAndMains) {
  LogIn();
  for (unsigned address = 0; address < 52; ++address) {
    const unsigned in_set = address % 13;
    const unsigned value = in_set < 8 ? 1000 + address : in_set == 8 ? 1 + address / 13 : 100 + address;
    ASSERT_EQ(Error(Ask({0x06, 0, Byte(address), Byte(value >> 8U), Byte(value)})), 0U);
  }
  EXPECT_THAT(Registers(0x04, 0, 9), ElementsAre(1000, 1002, 1004, 1006, 1, 109, 110, 111, 112));
  EXPECT_THAT(Hex("02 00 00 00 01"), ElementsAre(0x02, 1, 0));
  unit_.settings.mains_60_hz = true;
  unit_.settings.dip_set = 3;
  EXPECT_THAT(Registers(0x04, 0, 9), ElementsAre(1027, 1029, 1031, 1033, 3, 135, 136, 137, 138));
  EXPECT_THAT(Hex("02 00 00 00 01"), ElementsAre(0x02, 1, 1));
  unit_.settings.dip_set = 4;
  EXPECT_THAT(Registers(0x04, 8, 1), ElementsAre(151));
}

// ---- login: guideline 6 note 1, 10, 11 ----

TEST_F(UnitRequestTest, ThePasswordTogglesTheLogin) {
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0x0000));
  EXPECT_THAT(WriteText(100, "password"), ElementsAre(0x10, 0, 100, 0, 8));
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0xFF00));
  EXPECT_EQ(Error(WriteText(100, "passwore")), kLoginError);
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0xFF00)) << "a wrong one changes nothing";
  EXPECT_EQ(Error(WriteText(100, "password", ' ')), 0U);
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0x0000));
  EXPECT_THAT(Registers(0x03, 100, 8), ElementsAre(0, 0, 0, 0, 0, 0, 0, 0));
}

TEST_F(UnitRequestTest, TheLoginIsLostWithThePower) {
  LogIn();
  ASSERT_EQ(Error(WriteText(200, "~!kept-over-off!")), 0U);
  unit_.SetPower(false);
  unit_.SetPower(true);
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0x0000));
  EXPECT_EQ(Error(Hex("06 00 36 00 0A")), kLoginError);
  EXPECT_EQ(Error(WriteText(100, "password")), kLoginError);
  EXPECT_EQ(Error(WriteText(100, "~!kept-over-off!")), 0U) << "16 characters, without padding";
}

TEST_F(UnitRequestTest, ThePasswordCanBeReadWhenLoggedIn) {
  LogIn();
  EXPECT_THAT(Registers(0x03, 200, 8), ElementsAre(0x7061, 0x7373, 0x776F, 0x7264, 0, 0, 0, 0));
  ASSERT_EQ(Error(WriteText(200, "twelve-chars", ' ')), 0U);
  EXPECT_THAT(Hex("03 00 C8 00 08"),
              ElementsAre(0x03, 16, 't', 'w', 'e', 'l', 'v', 'e', '-', 'c', 'h', 'a', 'r', 's', 0, 0, 0, 0));
  EXPECT_THAT(Registers(0x04, 300, 1), ElementsAre(0xFF00)) << "a new password logs nobody out";
}

TEST_F(UnitRequestTest, OtherOrdersOfBytesAndCharacters) {
  unit_.settings.product_code = "AB12";
  unit_.settings.low_character_first = true;
  EXPECT_THAT(Hex("03 01 2C 00 02"), ElementsAre(0x03, 4, 'B', 'A', '2', '1'));
  EXPECT_EQ(Error(WriteText(100, "apssowdr")), 0U);
  unit_.settings.low_byte_first = true;
  EXPECT_THAT(Hex("03 01 2C 00 02"), ElementsAre(0x03, 4, 'A', 'B', '1', '2'));
  EXPECT_THAT(Hex("04 01 2C 00 01"), ElementsAre(0x04, 2, 0x00, 0xFF));
  EXPECT_THAT(Hex("06 00 36 07 00"), ElementsAre(0x06, 0, 54, 7, 0));
  EXPECT_EQ(unit_.HoldingRegister(54), 7);
}

// ---- coils: guideline 8 ----

TEST_F(UnitRequestTest, StopAndStartOfTheMotor) {
  LogIn();
  ASSERT_TRUE(unit_.motor.running());
  EXPECT_THAT(Hex("05 00 64 FF 00"), ElementsAre(0x05, 0, 100, 0xFF, 0));
  EXPECT_FALSE(unit_.motor.running());
  EXPECT_THAT(Hex("01 00 64 00 01"), ElementsAre(0x01, 1, 1));
  EXPECT_EQ(Error(Hex("05 00 64 00 00")), 0U);
  EXPECT_THAT(Hex("01 00 64 00 01"), ElementsAre(0x01, 1, 1)) << "only Start turns it off";
  EXPECT_THAT(Hex("0F 00 C8 00 01 01 01"), ElementsAre(0x0F, 0, 200, 0, 1));
  EXPECT_TRUE(unit_.motor.running());
  EXPECT_THAT(Hex("01 00 64 00 01"), ElementsAre(0x01, 1, 0));
  EXPECT_THAT(Hex("01 00 C8 00 01"), ElementsAre(0x01, 1, 0)) << "turns itself off";
}

TEST_F(UnitRequestTest, StartDoesNothingWhileTripped) {
  LogIn();
  ASSERT_TRUE(unit_.ForceTrip(kOverheat));
  EXPECT_THAT(Registers(0x04, 200, 5), ElementsAre(1, 0x20, 0x20, 0, 0));
  EXPECT_EQ(Error(Hex("05 00 C8 FF 00")), 0U);
  EXPECT_FALSE(unit_.motor.running());
  EXPECT_THAT(Hex("01 00 C8 00 01"), ElementsAre(0x01, 1, 0));
  EXPECT_EQ(Error(Hex("05 00 00 FF 00")), 0U);
  EXPECT_THAT(Registers(0x04, 200, 5), ElementsAre(0, 0x20, 0x20, 0, 0)) << "the count is cleared, nothing else";
  EXPECT_THAT(Hex("01 00 00 00 01"), ElementsAre(0x01, 1, 0));
  unit_.ResetTrip();
  EXPECT_FALSE(unit_.motor.running());
  EXPECT_EQ(Error(Hex("05 00 C8 FF 00")), 0U);
  EXPECT_TRUE(unit_.motor.running());
}

}  // namespace
}  // namespace axlecast::tsubaki_sc::simulator
