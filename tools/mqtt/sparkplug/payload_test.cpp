#include "tools/mqtt/sparkplug/payload.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "core/base/text.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

// The expected bytes are computed by hand from the schema in chapter 6 of the specification 3.0.0 and from protobuf's encoding
// (https://protobuf.dev/programming-guides/encoding): key = field number x 8 + wire type.

std::string Hex(const SparkplugPayload& payload) { return HexDigits(AsBytes(EncodePayload(payload))); }

// One metric without a name, at 1 ms; payload 12 (metrics) and the length are removed.
std::string ValueHex(SparkplugType type, SparkplugValue value) {
  const std::string all = Hex({.timestamp_ms = 0,
                               .seq = std::nullopt,
                               .metrics = {{.timestamp_ms = 1, .type = type, .value = std::move(value)}}});
  const std::string head =
      "0800"
      "12";  // timestamp 0, metrics
  EXPECT_EQ(all.substr(0, head.size()), head);
  return all.substr(head.size() + 2);
}

TEST(SparkplugPayload, AWholePayloadByHand) {
  const SparkplugPayload payload{
      .timestamp_ms = 300,
      .seq = 7,
      .metrics = {{.name = "a", .alias = 2, .timestamp_ms = 3, .type = SparkplugType::kInt32, .value = -5}}};
  EXPECT_EQ(Hex(payload),
            "08ac02"        // 1 timestamp = 300
            "120f"          // 2 metrics, 15 bytes
            "0a0161"        // 1 name = "a"
            "1002"          // 2 alias = 2
            "1803"          // 3 timestamp = 3
            "2003"          // 4 datatype = 3, Int32
            "50fbffffff0f"  // 10 int_value = 0xFFFFFFFB
            "1807");        // 3 seq = 7
}

TEST(SparkplugPayload, SeqIsLeftOutOrZeroButNotBoth) {
  EXPECT_EQ(Hex({.timestamp_ms = 1, .seq = std::nullopt}), "0801");
  EXPECT_EQ(Hex({.timestamp_ms = 1, .seq = 0}), "08011800");
  EXPECT_EQ(Hex({.timestamp_ms = 1, .seq = 255}), "080118ff01");
}

TEST(SparkplugPayload, EveryTypeOfValueByHand) {
  EXPECT_EQ(ValueHex(SparkplugType::kInt32, 1),
            "18012003"
            "5001");
  EXPECT_EQ(ValueHex(SparkplugType::kInt32, std::numeric_limits<std::int32_t>::min()),
            "18012003"
            "508080808008");
  EXPECT_EQ(ValueHex(SparkplugType::kInt64, std::int64_t{-1}),
            "18012004"
            "58ffffffffffffffffff01");
  EXPECT_EQ(ValueHex(SparkplugType::kInt64, std::int64_t{300}),
            "18012004"
            "58ac02");
  EXPECT_EQ(ValueHex(SparkplugType::kUInt32, std::uint32_t{0xFFFFFFFF}),
            "18012007"
            "50ffffffff0f");
  EXPECT_EQ(ValueHex(SparkplugType::kFloat, 1.5F),
            "18012009"
            "650000c03f");
  EXPECT_EQ(ValueHex(SparkplugType::kDouble, 1.5),
            "1801200a"
            "69000000000000f83f");
  EXPECT_EQ(ValueHex(SparkplugType::kBoolean, true),
            "1801200b"
            "7001");
  EXPECT_EQ(ValueHex(SparkplugType::kBoolean, false),
            "1801200b"
            "7000");
  EXPECT_EQ(ValueHex(SparkplugType::kString, std::string("ab")),
            "1801200c"
            "7a026162");
  EXPECT_EQ(ValueHex(SparkplugType::kString, std::string()),
            "1801200c"
            "7a00");
}

TEST(SparkplugPayload, NullAndNanHaveNoValue) {
  EXPECT_EQ(ValueHex(SparkplugType::kInt64, {}),
            "18012004"
            "3801");
  EXPECT_EQ(ValueHex(SparkplugType::kDouble, std::nan("")),
            "1801200a"
            "3801");
  EXPECT_EQ(ValueHex(SparkplugType::kFloat, std::nanf("")),
            "18012009"
            "3801");
}

TEST(SparkplugPayload, FlagsAndPropertiesByHand) {
  SparkplugMetric metric{.timestamp_ms = 1,
                         .type = SparkplugType::kBoolean,
                         .is_historical = true,
                         .is_transient = true,
                         .value = true};
  metric.properties = {{"Quality", SparkplugType::kInt32, 192}, {"u", SparkplugType::kString, std::string("mm")}};
  EXPECT_EQ(Hex({.timestamp_ms = 0, .seq = std::nullopt, .metrics = {metric}}),
            "0800"
            "1227"  // 39 bytes: 8 of the flags, 2 + 27 of the properties, 2 of the value
            "1801"
            "200b"
            "2801"
            "3001"                // timestamp, datatype, is_historical, is_transient
            "4a1b"                // 9 properties, 27 bytes: 9 + 3 + 7 + 8
            "0a075175616c697479"  // 1 keys: "Quality"
            "0a0175"              // "u"
            "120508031"
            "8c001"             // 2 values: type 3 Int32, int_value 192
            "1206080c42026d6d"  // type 12 String, string_value "mm"
            "7001");
}

std::optional<std::vector<ReceivedMetric>> Decode(const std::string& bytes) { return DecodePayload(bytes); }

TEST(SparkplugPayload, ARebirthRequestOfAnotherEncoderIsRead) {
  // As sparkplug-payload 1.0.3 writes {timestamp: 1, metrics: [{name: "Node Control/Rebirth", type: "Boolean", value: true}]}.
  const std::string name = "Node Control/Rebirth";
  const std::string metric = "\x0a\x14" + name + "\x20\x0b\x70\x01";
  const auto metrics = Decode("\x08\x01\x12" + std::string(1, static_cast<char>(metric.size())) + metric);
  ASSERT_TRUE(metrics);
  ASSERT_EQ(metrics->size(), 1U);
  EXPECT_EQ(metrics->front().name, name);
  EXPECT_EQ(metrics->front().boolean, true);
}

TEST(SparkplugPayload, OtherFieldsAreSkipped) {
  using namespace std::string_literals;
  const auto metrics = Decode(
      "\x22\x01z\x2a\x03\x00\x01\x02"s  // uuid, body
      "\x12\x1a"                        // a metric of 26 bytes
      "\x0a\x01q\x4a\x02\x0a\x00"       // name, properties
      "\x65\x00\x00\x00\x00"            // float
      "\x69\x00\x00\x00\x00\x00\x00\x00\x00"
      "\x70\x00\xa8\x7d\x05"s);  // false; field 2005, unknown
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->front().name, "q");
  EXPECT_EQ(metrics->front().boolean, false);
}

TEST(SparkplugPayload, DamagedBytesAreRefused) {
  using namespace std::string_literals;
  EXPECT_TRUE(Decode(""));
  for (const std::string& bytes : {"\x08"s,                                              // no number
                                   "\x08\x80"s,                                          // a number that ends early
                                   "\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"s,  // of more than 64 bits
                                   "\x12\x05\x0a"s,                                      // shorter than announced
                                   "\x12\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"s,      // a length of 2^64 - 1
                                   "\x12\x02\x0a\x05"s,  // likewise, within a metric
                                   "\x10\x01"s,          // metrics as a number
                                   "\x00\x01"s,          // field 0
                                   "\x0b\x0c"s,          // a group
                                   "\x0f"s,              // wire type 7
                                   "\x0d\x01\x02"s,      // half a number
                                   "{\"online\":true}"s}) {
    EXPECT_FALSE(Decode(bytes)) << HexDigits(AsBytes(bytes));
  }
}

}  // namespace
}  // namespace axlecast
