#include "tools/fleet/read/table_writer.h"

#include <gmock/gmock.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace axlecast {
namespace {

std::string Written(TableFormat format, const std::function<void(TableWriter&)>& rows,
                    std::vector<std::string> columns = {"n", "x", "text"}) {
  std::string all;
  TableWriter table(format, std::move(columns), [&](std::string_view piece) {
    all += piece;
    return true;
  });
  rows(table);
  EXPECT_TRUE(table.End());
  return all;
}

TEST(TableWriter, WritesNamesFirstInCsv) {
  EXPECT_EQ(Written(TableFormat::kCsv, [](TableWriter&) {}), "n,x,text\r\n");
}

TEST(TableWriter, QuotesCellsAsRfc4180Requires) {
  EXPECT_EQ(Written(TableFormat::kCsv,
                    [](TableWriter& table) { table.Int(1).Float(0.5).Text("a \"b\", c\nd").EndRow(); }),
            "n,x,text\r\n1,0.5,\"a \"\"b\"\", c\nd\"\r\n");
}

TEST(TableWriter, LeavesNoFormulaInACell) {
  EXPECT_EQ(Written(TableFormat::kCsv, [](TableWriter& table) { table.Int(-1).Float(-2).Text("=1+1").EndRow(); }),
            "n,x,text\r\n-1,-2,'=1+1\r\n");
}

TEST(TableWriter, ShowsUnknownValuesAsEmptyCells) {
  const auto rows = [](TableWriter& table) {
    table.Null().Float(std::numeric_limits<double>::quiet_NaN()).Null().EndRow();
    table.Int(2).Float(std::numeric_limits<double>::infinity()).Text("").EndRow();
  };
  EXPECT_EQ(Written(TableFormat::kCsv, rows), "n,x,text\r\n,,\r\n2,,\r\n");
  EXPECT_EQ(Written(TableFormat::kJsonl, rows),
            "{\"n\":null,\"x\":null,\"text\":null}\n{\"n\":2,\"x\":null,\"text\":\"\"}\n");
}

TEST(TableWriter, WritesOneArrayInJson) {
  EXPECT_EQ(Written(TableFormat::kJson, [](TableWriter&) {}), "[]\n");
  const std::string text = Written(TableFormat::kJson, [](TableWriter& table) {
    table.Int(1).Float(1e300).Text("\x1b\xff").EndRow();
    table.Int(INT64_MIN).Bool(true).Json("{\"a\":[1]}").EndRow();
  });
  const auto json = nlohmann::json::parse(text);
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["x"], 1e300);
  EXPECT_EQ(json[0]["text"], "\x1b\xEF\xBF\xBD");
  EXPECT_EQ(json[1]["n"], INT64_MIN);
  EXPECT_EQ(json[1]["text"]["a"][0], 1);
}

TEST(TableWriter, WritesJsonAsTextInCsv) {
  EXPECT_EQ(Written(TableFormat::kCsv, [](TableWriter& table) { table.Json("{\"a\":1}").EndRow(); }, {"message"}),
            "message\r\n\"{\"\"a\"\":1}\"\r\n");
}

TEST(TableWriter, WritesNumbersThatReadBackTheSame) {
  const std::string text = Written(
      TableFormat::kJsonl, [](TableWriter& table) { table.Float(0.1).Float(1.0 / 3).Float(1e-7).EndRow(); });
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["n"], 0.1);
  EXPECT_EQ(json["x"], 1.0 / 3);
  EXPECT_EQ(json["text"], 1e-7);
}

TEST(TableWriter, WritesTimesToTheMicrosecond) {
  EXPECT_EQ(UtcMicrosecondText(1'795'244'405'000'042), "2026-11-21T07:00:05.000042Z");
  EXPECT_EQ(UtcMicrosecondText(-1), "1969-12-31T23:59:59.999999Z");
  EXPECT_EQ(UtcMicrosecondText(INT64_MAX), "294247-01-10T04:00:54.775807Z");
}

TEST(TableWriter, StopsWhenTheReaderIsGone) {
  int pieces = 0;
  TableWriter table(TableFormat::kCsv, {"text"}, [&](std::string_view) { return ++pieces < 2; });
  std::int64_t rows = 0;
  while (table.Text(std::string(1'000, 'x')).EndRow()) ASSERT_LT(++rows, 1'000);
  EXPECT_FALSE(table.good());
  EXPECT_FALSE(table.End());
  EXPECT_EQ(pieces, 2);
}

TEST(TableWriter, HoldsLittleOfALargeAnswer) {
  std::size_t largest = 0;
  std::size_t bytes = 0;
  TableWriter table(TableFormat::kJson, {"n"}, [&](std::string_view piece) {
    largest = std::max(largest, piece.size());
    bytes += piece.size();
    return true;
  });
  for (int i = 0; i < 100'000; ++i) table.Int(i).EndRow();
  EXPECT_TRUE(table.End());
  EXPECT_GT(bytes, 1'000'000U);
  EXPECT_LT(largest, 100'000U);
}

}  // namespace
}  // namespace axlecast
