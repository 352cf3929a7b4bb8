#include "core/config/yaml_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ErrorsOf(const std::string& text) {
  ConfigErrors errors("m.yaml");
  static_cast<void>(ParseYaml(text, errors));
  return errors.Text();
}

TEST(FindOpenQuote, NamesTheLineWhereItOpens) {
  const auto open = FindOpenQuote("a: 'x'\nb: {c: \"y\\\"\", d: \"z}\ne: 1\n");
  ASSERT_TRUE(open);
  EXPECT_EQ(open->line, 1);
  EXPECT_EQ(open->column, 17);
  EXPECT_EQ(open->quote, '"');
}

TEST(FindOpenQuote, LeavesQuotesThatAreOnlyCharacters) {
  for (const char* text : {"a: it's\n", "a: b # don't\n", "a: |\n  \"text\n  it's\nb: 1\n", "a: 'it''s'\n",
                           "- 5\"\n", "a: b, 'c\n", "'a': \"b\"\n", "a: [b, 'c', \"d\"]\n", ""}) {
    EXPECT_FALSE(FindOpenQuote(text)) << text;
  }
  EXPECT_TRUE(FindOpenQuote("a: [b, 'c]\n"));
  EXPECT_TRUE(FindOpenQuote("- 'c\n"));
  EXPECT_TRUE(FindOpenQuote("a:\n  |\n  x\nb: 'c"));
}

// The parser stops at the end of the text, or at the next quote.
TEST(ParseYaml, ReportsAnUnclosedQuoteWhereItOpens) {
  EXPECT_THAT(ErrorsOf("machine: press3\nlcm: {url: 'udpm://239.255.76.67:7667}\nbuses:\n  b0: {}\n"),
              StartsWith("m.yaml:2:12: not YAML: the quote ' that opens here is not closed in its line"));
  EXPECT_THAT(ErrorsOf("machine: \"press3\nlcm: {url: \"udpm://239.255.76.67:7667\"}\n"),
              StartsWith("m.yaml:1:10: not YAML: the quote \" that opens here is not closed in its line"));
  EXPECT_THAT(ErrorsOf("machine: \"press3\nbuses:\n"), HasSubstr("m.yaml:1:10: "));
}

TEST(ParseYaml, AValueOfSeveralLinesIsStillYaml) {
  EXPECT_EQ(ErrorsOf("a: \"x\n  y\"\n"), "");
  EXPECT_EQ(ErrorsOf("a: some text\n  'tis one value\nb: 1\n"), "") << "a quote within a value";
}

}  // namespace

}  // namespace axlecast
