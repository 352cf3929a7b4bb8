#include "core/base/markup.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

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
