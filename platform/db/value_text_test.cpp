#include "platform/db/value_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace axlecast::db {
namespace {

// The texts are PostgreSQL 15's: SELECT … with DateStyle ISO; the numbers its extract(epoch FROM …).
TEST(DatabaseTime, ParsesEveryOffset) {
  constexpr std::int64_t kTime = 1'795'776'587'123'456;
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 10:49:47.123456+00"), kTime);
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 11:49:47.123456+01"), kTime);
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 07:19:47.123456-03:30"), kTime);
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 11:09:19.123456+00:19:32"), kTime);
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 10:49:47+00"), 1'795'776'587'000'000);
  EXPECT_EQ(ParseDatabaseTime("2026-11-27 10:49:47.5+00"), 1'795'776'587'500'000);
  EXPECT_EQ(ParseDatabaseTime("1969-12-31 23:59:59.999999+00"), -1);
}

TEST(DatabaseTime, RefusesOtherTexts) {
  for (const char* text : {"", "infinity", "-infinity", "2026-11-27", "2026-11-27 10:49:47",
                           "2026-02-30 10:49:47+00", "2026-11-27 10:49:47.+00", "2026-11-27 10:49:47.1234567+00",
                           "2026-11-27 10:49:47+0", "2026-11-27 10:49:47+00x", "2026-11-27 10:49:47+00:",
                           "2026-11-27 10:49:47+-1", "12026-11-27 10:49:47+00", "2026-11-27 10:49:47+00 BC"}) {
    EXPECT_EQ(ParseDatabaseTime(text), std::nullopt) << text;
  }
}

TEST(DatabaseTime, FormatsWhatItParses) {
  EXPECT_EQ(DatabaseTimeText(1'795'776'587'123'456), "2026-11-27 10:49:47.123456+00");
  EXPECT_EQ(DatabaseTimeText(-1), "1969-12-31 23:59:59.999999+00");
  EXPECT_EQ(DatabaseTimeText(-30'610'224'000'000'000), "1000-01-01 00:00:00.000000+00");
  EXPECT_EQ(DatabaseTimeText(-30'610'224'000'000'001), "-infinity");
  EXPECT_EQ(DatabaseTimeText(253'402'300'799'999'999), "9999-12-31 23:59:59.999999+00");
  EXPECT_EQ(DatabaseTimeText(253'402'300'800'000'000), "infinity");
  EXPECT_EQ(DatabaseTimeText(std::numeric_limits<std::int64_t>::max()), "infinity");
  EXPECT_EQ(DatabaseTimeText(std::numeric_limits<std::int64_t>::min()), "-infinity");
}

TEST(Bytea, ParsesHexadecimal) {
  EXPECT_EQ(ParseBytea("\\x"), std::string());
  EXPECT_EQ(ParseBytea("\\x00ffa1"), std::string("\0\xff\xa1", 3));
  EXPECT_EQ(ParseBytea("\\x0"), std::nullopt);
  EXPECT_EQ(ParseBytea("\\xzz"), std::nullopt);
  EXPECT_EQ(ParseBytea("00"), std::nullopt);
}

TEST(FloatText, IsExact) {
  EXPECT_EQ(FloatText(0.1), "0.1");
  EXPECT_EQ(FloatText(1e300), "1e+300");
  EXPECT_EQ(FloatText(5e-324), "5e-324");
  EXPECT_EQ(FloatText(std::nan("")), "NaN");
  EXPECT_EQ(FloatText(-std::numeric_limits<double>::infinity()), "-Infinity");
}

TEST(JsonbText, ReplacesNulButNotAnEscapedBackslash) {
  EXPECT_EQ(JsonbText(R"("a\u0000b\\u0000\\\u0000")"), R"("a\ufffdb\\u0000\\\ufffd")");
  EXPECT_EQ(JsonbText(R"("\)"), R"("\)");
}

TEST(QuotedElement, EscapesQuotesAndBackslashes) { EXPECT_EQ(QuotedElement(R"(a"\,{})"), R"("a\"\\,{}")"); }

}  // namespace
}  // namespace axlecast::db
