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

// OWASP, "CSV Injection".
TEST(CsvLine, HasNoFormulas) {
  EXPECT_EQ(CsvLine({"=1+1", "+A1", "@SUM(A1)", "-2+3", "\tx"}), "'=1+1,'+A1,'@SUM(A1),'-2+3,'\tx\r\n");
  EXPECT_EQ(CsvLine({"\r=1", "=HYPERLINK(\"http://x\",1)"}), "\"'\r=1\",\"'=HYPERLINK(\"\"http://x\"\",1)\"\r\n");
  EXPECT_EQ(CsvLine({"-12.5", "-1e-05", "-0", "12", "a=b", "-"}), "-12.5,-1e-05,-0,12,a=b,'-\r\n");
}

TEST(CsvLine, IsAlwaysText) {
  EXPECT_EQ(CsvLine({"\xFF", std::string("a\0b", 3)}),
            "\xEF\xBF\xBD,a\xEF\xBF\xBD"
            "b\r\n");
}

}  // namespace
}  // namespace axlecast
