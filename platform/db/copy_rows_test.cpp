#include "platform/db/copy_rows.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/text.h"

namespace axlecast::db {
namespace {

std::string Hex(std::string_view bytes) {
  return HexDigits(Bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()));  // NOLINT
}

// From `psql -c "COPY (SELECT …) TO STDOUT (FORMAT binary)" | xxd -p` of PostgreSQL 15.
constexpr const char* kHeader = "5047434f50590aff0d0a000000000000000000";

TEST(CopyRows, BeginsWithTheHeader) {
  const CopyRows rows(1);
  EXPECT_EQ(Hex(rows.encoded()), kHeader);
  EXPECT_TRUE(rows.empty());
}

// SELECT true, 1::int2, -2::int4, 3000000000::int8, 1.5::float4, 'NaN'::float8, 'aé', '\x00ff'::bytea, NULL::int4
TEST(CopyRows, EncodesAsPostgresDoes) {
  CopyRows rows(9);
  const std::array<std::uint8_t, 2> bytes{0x00, 0xff};
  rows.Row()
      .Bool(true)
      .Int2(1)
      .Int4(-2)
      .Int8(3'000'000'000)
      .Float4(1.5F)
      .Float8(__builtin_nan(""))
      .Text("a\u00e9")
      .Binary(bytes)
      .Null();
  EXPECT_EQ(Hex(rows.encoded()).substr(38),
            "0009"
            "0000000101"
            "000000020001"
            "00000004fffffffe"
            "0000000800000000b2d05e00"
            "000000043fc00000"
            "000000087ff8000000000000"
            "0000000361c3a9"
            "0000000200ff"
            "ffffffff");
  EXPECT_EQ(rows.size(), 1U);
}

// A server writes a blank behind the colon of its jsonb. SELECT '2026-11-27 10:49:47.123456+00'::timestamptz, '-infinity'::timestamptz, '{"a":1}'::jsonb,
//        '00112233-4455-6677-8899-aabbccddeeff'::uuid, '{1,-1}'::int8[], '{}'::int8[]
TEST(CopyRows, EncodesTimesJsonUuidsAndArrays) {
  CopyRows rows(6);
  const std::array<std::uint8_t, 16> uuid{0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77,
                                          0x88, 0x99, 0xaa, 0xbb, 0xcc, 0xdd, 0xee, 0xff};
  const std::vector<std::int64_t> values{1, -1};
  rows.Row()
      .Timestamp(1'795'776'587'123'456)
      .Timestamp(INT64_MIN)
      .Jsonb(R"({"a":1})")
      .Uuid(uuid)
      .Int8Array(values)
      .Int8Array({});
  EXPECT_EQ(Hex(rows.encoded()).substr(38),
            "0006"
            "000000080003043e965a6b00"
            "000000088000000000000000"
            "00000008017b2261223a317d"
            "0000001000112233445566778899aabbccddeeff"
            "0000002c000000010000000000000014000000020000000100000008000000000000000100000008ffffffffffffffff"
            "0000000c000000000000000000000014");
}

TEST(CopyRows, ReplacesWhatTextAndJsonbRefuse) {
  CopyRows rows(2);
  rows.Row().Text(std::string_view("a\0b\xff", 4)).Jsonb(R"(["\u0000","\\u0000"])");
  EXPECT_EQ(rows.encoded().substr(19), std::string_view("\0\2"
                                                        "\0\0\0\x08"
                                                        "a\uFFFDb\uFFFD"
                                                        "\0\0\0\x15"
                                                        "\1"
                                                        R"(["\ufffd","\\u0000"])",
                                                        39));
}

TEST(CopyRows, ClearLeavesTheHeader) {
  CopyRows rows(1);
  rows.Row().Int4(7);
  rows.Clear();
  EXPECT_EQ(Hex(rows.encoded()), kHeader);
  EXPECT_EQ(rows.size(), 0U);
}

TEST(CopyRows, CountsMicrosecondsFrom2000) {
  EXPECT_EQ(PostgresMicroseconds(946'684'800'000'000), 0);
  EXPECT_EQ(PostgresMicroseconds(0), -946'684'800'000'000);
  // 4714-11-24 BC is the first day of PostgreSQL (datatype/timestamp.h).
  EXPECT_EQ(PostgresMicroseconds(-210'866'803'200'000'000), -211'813'488'000'000'000);
  EXPECT_EQ(PostgresMicroseconds(-210'866'803'200'000'001), INT64_MIN);
  EXPECT_EQ(PostgresMicroseconds(INT64_MAX), INT64_MAX - 946'684'800'000'000);
}

}  // namespace
}  // namespace axlecast::db
