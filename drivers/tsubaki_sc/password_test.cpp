#include "drivers/tsubaki_sc/password.h"

#include <gtest/gtest.h>

#include "drivers/tsubaki_sc/unit_test_support.h"

namespace axlecast::tsubaki_sc {
namespace {

ByteList ListOf(const Frame& frame) { return {frame.data(), frame.data() + frame.size()}; }

// Guideline 5, error 03, and 11: 8 to 16 characters from ! to ~.
TEST(Password, HasEightToSixteenPrintableCharacters) {
  EXPECT_TRUE(IsPassword("password"));
  EXPECT_TRUE(IsPassword("!~!~!~!~!~!~!~!~"));
  EXPECT_FALSE(IsPassword("passwor"));
  EXPECT_FALSE(IsPassword("12345678901234567"));
  EXPECT_FALSE(IsPassword("pass word"));
  EXPECT_FALSE(IsPassword("passw\x7Frd"));
  EXPECT_FALSE(IsPassword("passw\xC3\xB6rd"));
  EXPECT_FALSE(IsPassword(""));
}

TEST(Password, StandsInEightRegistersPaddedAsConfigured) {
  const ByteList head = {3, 0x10, 0x00, 0x64, 0x00, 0x08, 0x10};
  const auto written = [&](const PasswordFormat& format) {
    return ListOf(WritePassword(3, kLoginBlock, "passwords", format));
  };
  ByteList expected = head;
  for (const char c : std::string("passwords\0\0\0\0\0\0\0", 16)) expected.push_back(static_cast<std::uint8_t>(c));
  EXPECT_EQ(written({}), WithCrc(expected));
  expected = head;
  for (const char c : std::string("apssowdr s      ")) expected.push_back(static_cast<std::uint8_t>(c));
  EXPECT_EQ(written({.order = CharacterOrder::kLowFirst, .padding = 0x20}), WithCrc(expected));
  EXPECT_EQ(ListOf(WritePassword(1, kPassword, "password", {}))[3], 200);
}

TEST(Password, IsComparedWhateverPadsIt) {
  const auto holds = [](const std::string& registers, std::string_view text) {
    return HoldsPassword(ByteList(registers.begin(), registers.end()), text, CharacterOrder::kHighFirst);
  };
  const std::string nul(8, '\0');
  EXPECT_TRUE(holds("password" + nul, "password"));
  EXPECT_TRUE(holds("password        ", "password"));
  EXPECT_FALSE(holds("passwore" + nul, "password"));
  EXPECT_FALSE(holds("passwords" + nul.substr(1), "password")) << "a longer one that begins so";
  EXPECT_FALSE(holds("password" + nul, "passwords"));
  EXPECT_FALSE(holds("password", "password")) << "half of the registers";
  EXPECT_FALSE(holds("", "password"));
}

TEST(Password, IsGoneWhenWiped) {
  Frame frame = WritePassword(1, kLoginBlock, "password", {});
  Wipe(frame);
  EXPECT_TRUE(frame.empty());
  for (std::size_t i = 0; i < 32; ++i) EXPECT_EQ(frame.data()[i], 0) << i;
}

}  // namespace
}  // namespace axlecast::tsubaki_sc
