#include "core/base/utf8.h"

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

}  // namespace
}  // namespace axlecast
