#include "drivers/runtime/core/visible_text.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(VisibleText, LeavesWhatIsShown) {
  EXPECT_EQ(VisibleText("axis1: 5 \xC2\xB0, \xE2\x82\xAC, \xF0\x9F\x98\x80"),
            "axis1: 5 \xC2\xB0, \xE2\x82\xAC, \xF0\x9F\x98\x80");
  EXPECT_EQ(VisibleText(""), "");
}

TEST(VisibleText, ReplacesControlCharacters) {
  EXPECT_EQ(VisibleText("a\x1B[2Jb\r\n\x7F\t"), "a?[2Jb????");
  EXPECT_EQ(VisibleText("\xC2\x9B"
                        "2J"),
            "?2J")
      << "C1: CSI in one character";
  EXPECT_EQ(VisibleText(std::string("\0x", 2)), "?x");
}

TEST(VisibleText, ReplacesWhatChangesTheDirectionOrHides) {
  EXPECT_EQ(VisibleText("a\xE2\x80\xAE"
                        "b\xE2\x81\xA6"
                        "c\xE2\x80\x8F"),
            "a?b?c?");
  EXPECT_EQ(VisibleText("x\xE2\x80\x8By\xEF\xBB\xBFz\xE2\x80\xA8"), "x?y?z?");
}

TEST(VisibleText, ReplacesEachByteThatIsNoUtf8) {
  EXPECT_EQ(VisibleText("\x9B"
                        "2J\xFF"),
            "?2J?")
      << "C1 of ISO 8859-1";
  EXPECT_EQ(VisibleText("\xC0\x9B"), "??") << "overlong";
  EXPECT_EQ(VisibleText("\xE0\x82\x9B"), "???") << "overlong";
  EXPECT_EQ(VisibleText("\xED\xA0\x80"), "???") << "a surrogate";
  EXPECT_EQ(VisibleText("\xF4\x90\x80\x80"), "????") << "above U+10FFFF";
  EXPECT_EQ(VisibleText("\xE2\x80"), "??") << "cut off";
}

TEST(Shortened, EndsBetweenTwoCharacters) {
  EXPECT_EQ(Shortened("abc", 3), "abc");
  EXPECT_EQ(Shortened("abc", 2), "ab");
  EXPECT_EQ(Shortened("a\xE2\x82\xAC", 3), "a");
  EXPECT_EQ(Shortened("\xE2\x82\xAC", 2), "");
}

}  // namespace
}  // namespace axlecast
