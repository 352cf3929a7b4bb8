#include "tools/log/log_event.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

namespace axlecast {
namespace {

using testing::ElementsAreArray;

// Written by hand after LCM's "LCM Log File Format": number 5, 1'000'000 us, channel "AB", data 0x7F 0x00.
constexpr std::uint8_t kRecord[] = {0xED, 0xA1, 0xDA, 0x01, 0, 0, 0, 0, 0, 0, 0, 5, 0,   0,   0,    0,
                                    0,    0x0F, 0x42, 0x40, 0, 0, 0, 2, 0, 0, 0, 2, 'A', 'B', 0x7F, 0};

TEST(LogEvent, IsWrittenAsTheFormatSays) {
  std::vector<std::uint8_t> log;
  const std::uint8_t data[] = {0x7F, 0x00};
  const LogEvent event{.number = 5, .utime = 1'000'000, .channel = "AB", .data = data};
  AppendEvent(log, event);
  EXPECT_THAT(log, ElementsAreArray(kRecord));
  EXPECT_EQ(EventSize(event), log.size());
}

TEST(LogEvent, IsReadAsTheFormatSays) {
  const auto event = ParseEvent(kRecord);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->number, 5);
  EXPECT_EQ(event->utime, 1'000'000);
  EXPECT_EQ(event->channel, "AB");
  EXPECT_THAT(event->data, ElementsAreArray({0x7F, 0x00}));
}

TEST(LogEvent, ACutRecordIsNone) {
  for (std::size_t size = 0; size < sizeof(kRecord); ++size) EXPECT_FALSE(ParseEvent(Bytes(kRecord, size))) << size;
}

std::vector<std::uint8_t> With(std::size_t offset, std::vector<std::uint8_t> bytes) {
  std::vector<std::uint8_t> record(std::begin(kRecord), std::end(kRecord));
  std::copy(bytes.begin(), bytes.end(), record.begin() + static_cast<std::ptrdiff_t>(offset));
  record.resize(kLargestLogData + 1'000);
  return record;
}

TEST(LogEvent, LengthsThatNoRecorderWritesAreNone) {
  EXPECT_FALSE(ParseEvent(With(0, {0xED, 0xA1, 0xDA, 0x02})));
  EXPECT_FALSE(ParseEvent(With(20, {0, 0, 0, 0}))) << "a channel without a name";
  EXPECT_FALSE(ParseEvent(With(20, {0, 0, 1, 0}))) << "a channel of 256";
  EXPECT_FALSE(ParseEvent(With(20, {0xFF, 0xFF, 0xFF, 0xFF})));
  EXPECT_FALSE(ParseEvent(With(24, {0x04, 0, 0, 1}))) << "64 MiB and a byte";
  EXPECT_TRUE(ParseEvent(With(24, {0x04, 0, 0, 0})));
  EXPECT_FALSE(ParseEvent(With(24, {0xFF, 0xFF, 0xFF, 0xFF})));
  EXPECT_FALSE(ParseEvent(With(28, {'A', 0}))) << "NUL ends a channel";
}

TEST(LogEvent, TheExtremesComeBack) {
  const std::string channel(kLongestLogChannel, '\xFF');
  for (const std::int64_t number : {INT64_MIN, std::int64_t{-1}, INT64_MAX}) {
    std::vector<std::uint8_t> log;
    AppendEvent(log, {.number = number, .utime = ~number, .channel = channel, .data = {}});
    const auto event = ParseEvent(log);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->number, number);
    EXPECT_EQ(event->utime, ~number);
    EXPECT_EQ(event->channel, channel);
    EXPECT_TRUE(event->data.empty());
  }
}

}  // namespace

}  // namespace axlecast
