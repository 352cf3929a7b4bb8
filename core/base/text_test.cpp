#include "core/base/text.h"

#include <gtest/gtest.h>

#include <limits>

namespace axlecast {
namespace {

TEST(CappedText, ShortTextStays) { EXPECT_EQ(CappedText("12.5 rpm", 8), "12.5 rpm"); }

TEST(CappedText, CutsBetweenCharacters) {
  EXPECT_EQ(CappedText("43.5°", 6), "43.5°");  // the degree sign has two bytes
  EXPECT_EQ(CappedText("43.5°", 5), "43.5");
  EXPECT_EQ(CappedText("番地", 5), "番");
  EXPECT_EQ(CappedText("x", 0), "");
}

TEST(CappedText, ASentenceEndsAfterAWholeWord) {
  const std::string text = "the line is down: plug the adapter in";
  EXPECT_EQ(CappedText(text, text.size()), text);
  EXPECT_EQ(CappedText(text, text.size() - 1), "the line is down: plug the\u2026");
  EXPECT_EQ(CappedText(text, 26), "the line is down: plug\u2026")
      << "22 bytes and 3 of the mark; \"the\" has no room";
  EXPECT_EQ(CappedText(text, 25), "the line is down: plug\u2026");
  EXPECT_EQ(CappedText(text, 24), "the line is down:\u2026");
  for (std::size_t bytes = 0; bytes <= text.size(); ++bytes) EXPECT_LE(CappedText(text, bytes).size(), bytes);
  EXPECT_EQ(CappedText("in /a/very/long/path/of/a/file", 20), "in /a/very/long/p\u2026") << "rather than \"in\"";
}

TEST(CappedText, BytesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(CappedText("a\xFFz", 9), "a?z");
  EXPECT_EQ(CappedText("\xC0\x80", 9), "??");            // overlong NUL
  EXPECT_EQ(CappedText("\xED\xA0\x80", 9), "???");       // surrogate, RFC 3629 section 3
  EXPECT_EQ(CappedText("\xF4\x90\x80\x80", 9), "????");  // beyond U+10FFFF
  EXPECT_EQ(CappedText("\xE7\x95", 9), "??");            // truncated
}

TEST(CappedText, ControlCharactersAreReplaced) {
  EXPECT_EQ(CappedText("a\x1B[2J\n", 9), "a?[2J?");
  EXPECT_EQ(CappedText(std::string_view("\0b", 2), 9), "?b");
}

TEST(Columns, FillAndCut) {
  EXPECT_EQ(Left("ab", 4), "ab  ");
  EXPECT_EQ(Right("ab", 4), "  ab");
  EXPECT_EQ(Left("abcdef", 4), "abc\u2026");
  EXPECT_EQ(Right("abcdef", 4), "abc\u2026");
  EXPECT_EQ(Left("plug the adapter in", 14), "plug the\u2026     ") << "after a whole word, and filled up";
  EXPECT_EQ(Clip("abcdef", 6), "abcdef");
  EXPECT_EQ(Clip("abcdef", 0), "");
}

TEST(Columns, DecimalOfUnknownIsADash) {
  EXPECT_EQ(Decimal(1.25, 1), "1.2");
  EXPECT_EQ(Decimal(-0.5, 3), "-0.500");
  EXPECT_EQ(Decimal(std::numeric_limits<double>::quiet_NaN(), 1), "-");
  EXPECT_EQ(Decimal(std::numeric_limits<double>::infinity(), 1), "-");
  EXPECT_EQ(Decimal(1e300, 2), "1.00e+300");
}

TEST(Columns, PrintableKeepsTheMarkOfACutText) { EXPECT_EQ(Printable("cut\u2026"), "cut\u2026"); }

TEST(Columns, PrintableHasNoControlCharacters) { EXPECT_EQ(Printable("a\x1b[1m\n\xC3\xA9"), "a?[1m???"); }

}  // namespace

}  // namespace axlecast
