#include "tools/fleet/raw_records.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include "tools/log/log_fixture.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

std::vector<std::uint8_t> SomeLog() {
  ScriptedLog log(41);
  log.Add("WIRE/line1", "\x01\x02").Add("WIRE/line2", "").Add("WIRE/line1", std::string_view("\0\xFF", 2));
  return log.bytes();
}

RawRow RowOf(Bytes log) {
  RawRecords raw;
  LogReader reader(log);
  for (auto event = reader.Next(); event; event = reader.Next()) raw.Add(*event);
  return raw.Take();
}

TEST(RawRecords, ReturnTheBytesOfTheLog) {
  const auto log = SomeLog();
  const RawRow row = RowOf(log);
  EXPECT_EQ(row.first_event, 41);
  EXPECT_EQ(row.n, 3);
  EXPECT_EQ(row.t0, ScriptedLog::kStart);
  EXPECT_EQ(row.t1, ScriptedLog::kStart + 2'000);
  EXPECT_EQ(row.crc32c, Crc32c(0, log));
  EXPECT_EQ(DecodeRaw(row).value(), log);
}

TEST(RawRecords, BeginAgainAfterTake) {
  RawRecords raw;
  EXPECT_TRUE(raw.empty());
  raw.Add({.number = 1, .utime = 5, .channel = "A", .data = {}});
  EXPECT_EQ(raw.Take().n, 1);
  EXPECT_TRUE(raw.empty());
  raw.Add({.number = 9, .utime = 6, .channel = "B", .data = {}});
  const RawRow row = raw.Take();
  EXPECT_EQ(row.first_event, 9);
  EXPECT_EQ(row.t0, 6);
  EXPECT_EQ(DecodeRaw(row).value().size(), kEventHeader + 1);
}

TEST(RawRecords, ADamagedRowIsRefused) {
  const RawRow good = RowOf(SomeLog());
  for (std::size_t i = 0; i < good.records.size(); ++i) {
    RawRow bad = good;
    bad.records[i] ^= 0x10U;
    const auto records = DecodeRaw(bad);
    // A bit of zstd's own checks may not matter; then the records are right.
    EXPECT_TRUE(!records || *records == SomeLog()) << i;
  }
  RawRow bad = good;
  bad.crc32c ^= 1U;
  EXPECT_THAT(ErrorText(DecodeRaw(bad)), HasSubstr("CRC-32C"));
  bad = good;
  ++bad.n;
  EXPECT_THAT(ErrorText(DecodeRaw(bad)), HasSubstr("not as many"));
  bad = good;
  bad.first_event = 42;
  EXPECT_THAT(ErrorText(DecodeRaw(bad)), HasSubstr("another number"));
  bad.records.clear();
  EXPECT_THAT(ErrorText(DecodeRaw(bad)), HasSubstr("not compressed"));
}

TEST(RawRecords, AFalseSizeIsNotAllocated) {
  // A frame of zstd (RFC 8878, 3.1.1): magic number, a single segment with a size of 8 bytes, an empty last block.
  RawRow row{.n = 1};
  row.records = {0x28, 0xB5, 0x2F, 0xFD, 0xE0, 0, 0, 0, 0x3F, 0, 0, 0, 0, 1, 0, 0};
  EXPECT_THAT(ErrorText(DecodeRaw(row)), HasSubstr("cannot have"));
  row.records[8] = 0xFF;
  EXPECT_THAT(ErrorText(DecodeRaw(row)), HasSubstr("more than 1 GB"));
}

}  // namespace
}  // namespace axlecast
