#include "tools/convert/csv_line.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// RFC 4180, section 2.
TEST(CsvLine, QuotesWhatNeedsIt) {
  EXPECT_EQ(CsvLine({"aaa", "bbb", "ccc"}), "aaa,bbb,ccc\r\n");
  EXPECT_EQ(CsvLine({"aaa", "b \r\nbb", "ccc"}), "aaa,\"b \r\nbb\",ccc\r\n");
  EXPECT_EQ(CsvLine({"aaa", "b\"bb", "c,c"}), "aaa,\"b\"\"bb\",\"c,c\"\r\n");
  EXPECT_EQ(CsvLine({"", ""}), ",\r\n");
}

TEST(CsvLine, IsAlwaysText) {
  EXPECT_EQ(CsvLine({"\xFF", std::string("a\0b", 3)}),
            "\xEF\xBF\xBD,a\xEF\xBF\xBD"
            "b\r\n");
}

}  // namespace
}  // namespace axlecast
