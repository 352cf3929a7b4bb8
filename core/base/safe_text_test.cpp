#include "core/base/text.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(MendedUtf8, LeavesWhatIsGood) {
  EXPECT_EQ(MendedUtf8(""), "");
  EXPECT_EQ(MendedUtf8("a\"\\\n\t"), "a\"\\\n\t");
  EXPECT_EQ(MendedUtf8("\xC2\xB5m \xF0\x9F\x94\xA7"), "\xC2\xB5m \xF0\x9F\x94\xA7");
}

// One replacement for each longest part of a sequence that could have begun a character (Unicode 15, section 3.9).
TEST(MendedUtf8, ReplacesWhatIsNot) {
  EXPECT_EQ(MendedUtf8("\xFFz"), "\xEF\xBF\xBDz");
  EXPECT_EQ(MendedUtf8("a\xC2"), "a\xEF\xBF\xBD");
  EXPECT_EQ(MendedUtf8("\xF0\x9F\x94z"), "\xEF\xBF\xBDz");
}

constexpr const char* kMark = "\xEF\xBF\xBD";

TEST(TerminalText, LeavesTextInAnyLanguageAsItIs) {
  for (const char* text : {"", "a\tb\n", "\xC2\xB5m \xC2\xB0",
                           "\xE2\x88\x92"
                           "5 \xE2\x80\xA6",
                           "\xF0\x9F\x94\xA7", "\xD7\x90\xD7\x91", "\xEF\xBF\xBD"}) {
    EXPECT_EQ(TerminalText(text), text);
  }
}

TEST(TerminalText, TakesAwayWhatSteersATerminal) {
  EXPECT_EQ(TerminalText("\x1b]0;title\x07x\x1b[2Jy\rz\x7f"),
            std::string(kMark) + "]0;title" + kMark + "x" + kMark + "[2Jy" + kMark + "z" + kMark);
  EXPECT_EQ(TerminalText(std::string("a\0b\b", 4)), std::string("a") + kMark + "b" + kMark);
  // C1: CSI is one character of two bytes; a single byte of it is no UTF-8, and some terminals take it all the same.
  EXPECT_EQ(TerminalText("\xC2\x9B"
                         "31m"),
            std::string(kMark) + "31m");
  EXPECT_EQ(TerminalText("\x9B"
                         "31m"),
            std::string(kMark) + "31m");
}

// Unicode Technical Report 36, 2.10; "Trojan Source".
TEST(TerminalText, TakesAwayWhatReordersALineOrEndsIt) {
  for (const char* text : {"\xE2\x80\xAE", "\xE2\x80\xAA", "\xE2\x81\xA6", "\xE2\x81\xA9", "\xE2\x80\x8E",
                           "\xE2\x80\x8F", "\xD8\x9C", "\xE2\x80\xA8", "\xE2\x80\xA9"}) {
    EXPECT_EQ(TerminalText(std::string("a") + text + "b"), std::string("a") + kMark + "b");
  }
}

TEST(TerminalText, TakesAwayWhatIsNoUtf8) {
  for (const char* text : {"\xFF", "\xC0", "\xC2", "\xF5", "\x80"}) {
    EXPECT_EQ(TerminalText(std::string("a") + text + "b"), std::string("a") + kMark + "b");
  }
  EXPECT_EQ(FindUnsafe("\xC0\x9B")->code, 0xFFFDU) << "overlong";
  EXPECT_EQ(FindUnsafe("\xE0\x82\x9B")->code, 0xFFFDU) << "overlong";
  EXPECT_EQ(FindUnsafe("\xED\xA0\x80")->code, 0xFFFDU) << "a surrogate";
  EXPECT_EQ(FindUnsafe("\xF4\x90\x80\x80")->code, 0xFFFDU) << "above U+10FFFF";
}

TEST(TerminalText, OfOneLineHasNoBreakAndNothingHidden) {
  const auto one_line = [](std::string_view text) { return TerminalText(text, TextShape::kOneLine); };
  EXPECT_EQ(one_line("axis1: 5 \xC2\xB0, \xE2\x82\xAC, \xF0\x9F\x98\x80"),
            "axis1: 5 \xC2\xB0, \xE2\x82\xAC, \xF0\x9F\x98\x80");
  EXPECT_EQ(one_line("a\r\n\tb"), std::string("a") + kMark + kMark + kMark + "b");
  for (const char* hidden : {"\xC2\xAD", "\xE2\x80\x8B", "\xE2\x80\x8D", "\xE2\x81\xA0", "\xEF\xBB\xBF",
                             "\xEF\xBF\xB9", "\xF3\xA0\x80\xA0"}) {
    const std::string text = std::string("a") + hidden + "b";
    EXPECT_EQ(one_line(text), std::string("a") + kMark + "b");
    EXPECT_EQ(TerminalText(text), text) << "some scripts need it";
  }
  EXPECT_EQ(one_line("\xE2\x80\xAE"), kMark) << "and what is unsafe anywhere";
}

TEST(Shortened, EndsBetweenTwoCharacters) {
  EXPECT_EQ(Shortened("abc", 3), "abc");
  EXPECT_EQ(Shortened("abc", 2), "ab");
  EXPECT_EQ(Shortened("a\xE2\x82\xAC", 3), "a");
  EXPECT_EQ(Shortened("\xE2\x82\xAC", 2), "");
}

TEST(UnfinishedBytes, AreThoseOfACharacterThatMayGoOn) {
  EXPECT_EQ(UnfinishedBytes(""), 0U);
  EXPECT_EQ(UnfinishedBytes("abc"), 0U);
  EXPECT_EQ(UnfinishedBytes("a\xC2"), 1U);
  EXPECT_EQ(UnfinishedBytes("a\xC2\xB5"), 0U);
  EXPECT_EQ(UnfinishedBytes("\xF0\x9F\x94"), 3U);
  EXPECT_EQ(UnfinishedBytes("\xE2\x80"), 2U);
  EXPECT_EQ(UnfinishedBytes("\x80\x80\x80\x80"), 0U);
}

TEST(EscapedMarkup, LeavesNoMarkup) {
  EXPECT_EQ(EscapedMarkup("<b title='x'>\"&</b>"), "&lt;b title=&#39;x&#39;&gt;&quot;&amp;&lt;/b&gt;");
}

TEST(EscapedMarkup, MendsWhatNoPageMayHold) {
  EXPECT_EQ(EscapedMarkup("a\tb\nc"), "a\tb\nc");
  EXPECT_EQ(EscapedMarkup(std::string("a\0b\x1B[2J\x7F", 8)),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD[2J\xEF\xBF\xBD");
  EXPECT_EQ(EscapedMarkup("\xFFz"), "\xEF\xBF\xBDz");
  EXPECT_EQ(EscapedMarkup("\xC2\xB5m"), "\xC2\xB5m");
  EXPECT_EQ(EscapedMarkup("a\rb\xC2\x85"),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD");
  EXPECT_EQ(EscapedMarkup("\xEF\xBF\xBE\xEF\xBF\xBF"), "\xEF\xBF\xBD\xEF\xBF\xBD") << "not of XML's Char";
  EXPECT_EQ(EscapedMarkup("\xE2\x80\xAE"), "\xEF\xBF\xBD") << "it would write what follows from right to left";
}

}  // namespace

}  // namespace axlecast
