#include "drivers/saa_can/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/device/reading.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_can {
namespace {

std::uint32_t Identifier(const std::string& text) {
  return static_cast<std::uint32_t>(std::stoul(text, nullptr, 16));
}

std::vector<std::uint8_t> Padded(std::vector<std::uint8_t> bytes) {
  bytes.resize(kSentSize);
  return bytes;
}

std::vector<std::uint8_t> DataOf(const CanFrame& frame) {
  const Bytes data = frame.data;
  return {data.begin(), data.end()};
}

TEST(SaaCanCodec, PositionsOfTheManual) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "positions.txt", 5)) {
    const std::vector<std::uint8_t> data = GoldenBytes(row.columns[1]);
    const int bits = std::stoi(row.columns[2]);
    const Position position = ParsePosition(data, {.bits = bits});
    EXPECT_EQ(position.error, PositionError::kNone) << row.where;
    EXPECT_EQ(position.counts, std::stoul(row.columns[3])) << row.where;
    EXPECT_NEAR(Degrees(position.counts, bits), std::stod(row.columns[4]), 5e-5) << row.where;
    const std::uint32_t id = Identifier(row.columns[0]);
    EXPECT_EQ(id, DataId(static_cast<std::uint8_t>(id & kNodeMask))) << row.where;
  }
}

TEST(SaaCanCodec, EveryPrintedFrameThatIsSent) {
  const std::map<std::string, std::vector<CanFrame>> ours = {
      {"start", {CommandFrame(Command::kStart, 0x20), CommandFrame(Command::kStart, 0xFF)}},
      {"read", {CommandFrame(Command::kRead, 0x20)}},
      {"zero", {CommandFrame(Command::kZero, 0x20)}},
      {"direction", {CommandFrame(Command::kDirection, 0x20)}},
      {"period", {CommandFrame(Command::kPeriod, 0x20, 0x32)}},
      {"enter", {ModeFrame(true)}},
      {"node", {NodeFrame(0x20)}},
      {"bitrate", {BitrateFrame(*BitrateCode(500'000))}}};
  for (const GoldenRow& row : GoldenRows(__FILE__, "dialogues.txt", 5)) {
    if (row.columns[1] != "send") continue;
    bool found = false;
    for (const CanFrame& frame : ours.at(row.columns[4])) {
      found =
          found || (frame.id == Identifier(row.columns[2]) && DataOf(frame) == Padded(GoldenBytes(row.columns[3])));
    }
    EXPECT_TRUE(found) << row.where;
  }
}

TEST(SaaCanCodec, EveryPrintedReply) {
  const std::map<std::string, Command> commands = {
      {"zero", Command::kZero}, {"direction", Command::kDirection}, {"period", Command::kPeriod}};
  const std::map<std::string, Service> services = {{"node", Service::kNode}, {"bitrate", Service::kBitrate}};
  for (const GoldenRow& row : GoldenRows(__FILE__, "dialogues.txt", 5)) {
    if (row.columns[1] != "reply") continue;
    const std::vector<std::uint8_t> data = GoldenBytes(row.columns[3]);
    if (const auto service = services.find(row.columns[4]); service != services.end()) {
      const std::optional<ServiceReply> reply = ParseServiceReply(data);
      ASSERT_TRUE(reply) << row.where;
      EXPECT_EQ(reply->service, service->second) << row.where;
      EXPECT_EQ(reply->result, 0) << row.where;
      continue;
    }
    for (const Command command : kAcknowledged) {
      EXPECT_EQ(MayAcknowledge(data, command, 14), command == commands.at(row.columns[4])) << row.where;
    }
    // The ambiguity: it is a position as well.
    EXPECT_EQ(ParsePosition(data, {.bits = 14}).counts, data[0]) << row.where;
  }
}

// Errata: the bytes of positive (4) and inverse (5), of rate (7) and stop (8) are the same. So the command is known, but
// not which of the two; a byte that makes the difference is the file's.
TEST(SaaCanCodec, TheManualPrintsTwoPairsOfCommandsAlike) {
  std::map<std::string, std::vector<std::uint8_t>> sent;
  for (const GoldenRow& row : GoldenRows(__FILE__, "dialogues.txt", 5)) {
    if (row.columns[1] == "send") sent[row.columns[0]] = GoldenBytes(row.columns[3]);
  }
  for (const char* item : {"4", "5"}) {
    EXPECT_EQ(sent.at(item), DataOf(CommandFrame(Command::kDirection, 0x20))) << item;
    EXPECT_EQ(ParseRequest(sent.at(item))->command, Command::kDirection);
    EXPECT_EQ(ParseRequest(sent.at(item))->parameter, 0) << "neither sense is in the bytes";
  }
  for (const char* item : {"7", "8"}) {
    EXPECT_EQ(sent.at(item), DataOf(CommandFrame(Command::kPeriod, 0x20, 0x32))) << item;
    EXPECT_EQ(ParseRequest(sent.at(item))->command, Command::kPeriod);
  }
  EXPECT_NE(DataOf(CommandFrame(Command::kDirection, 0x20, 1)), sent.at("5")) << "with a byte of the file";
}

TEST(SaaCanCodec, BitRatesOfTheManual) {
  EXPECT_EQ(BitrateCode(1'000'000), 0x00);
  EXPECT_EQ(BitrateCode(500'000), 0x02);
  EXPECT_EQ(BitrateCode(250'000), 0x03);
  EXPECT_FALSE(BitrateCode(125'000));
  EXPECT_EQ(BitrateOf(0x02), 500'000);
  EXPECT_FALSE(BitrateOf(0x01));
  // The request for 1 Mbit/s has the bytes of the reply.
  EXPECT_EQ(DataOf(BitrateFrame(0x00)), Padded({0x13, 0x00}));
}

TEST(SaaCanCodec, TheResolutionDecidesHowManyBytesAPositionHas) {
  const std::vector<std::uint8_t> data = {0x56, 0x34, 0x12, 0x00};
  EXPECT_EQ(ParsePosition(data, {.bits = 16}).counts, 0x3456U);
  EXPECT_EQ(ParsePosition(data, {.bits = 24}).counts, 0x123456U);
  EXPECT_EQ(ParsePosition(data, {.bits = 26}).counts, 0x123456U);
  EXPECT_EQ(ParsePosition(data, {.bits = 24, .big_endian = true}).counts, 0x563412U);
  EXPECT_EQ(ParsePosition(data, {.bits = 16, .big_endian = true}).counts, 0x5634U);
}

TEST(SaaCanCodec, ShortFramesAndBitsAboveTheResolution) {
  const auto error = [](std::vector<std::uint8_t> data, int bits) {
    return ParsePosition(data, {.bits = bits}).error;
  };
  EXPECT_EQ(error({}, 10), PositionError::kShort);
  EXPECT_EQ(error({0x00}, 10), PositionError::kShort);
  EXPECT_EQ(error({0x00, 0x00}, 16), PositionError::kNone);
  EXPECT_EQ(error({0x00, 0x00}, 17), PositionError::kShort);
  EXPECT_EQ(error({0x00, 0x00, 0x00}, 25), PositionError::kShort);
  EXPECT_EQ(error({0xFF, 0x03}, 10), PositionError::kNone);
  EXPECT_EQ(error({0x00, 0x04}, 10), PositionError::kRange);
  EXPECT_EQ(error({0x00, 0x00, 0x02}, 17), PositionError::kRange);
  EXPECT_EQ(error({0xFF, 0xFF, 0xFF, 0x03}, 26), PositionError::kNone);
  EXPECT_EQ(error({0x00, 0x00, 0x00, 0x04}, 26), PositionError::kRange);
  // What is behind is no part of it.
  EXPECT_EQ(error({0x00, 0x00, 0xFF, 0xFF}, 16), PositionError::kNone);
}

TEST(SaaCanCodec, WhatMayBeAReplyReachesAsFarAsThePosition) {
  const std::vector<std::uint8_t> data = {0x22, 0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00};
  EXPECT_TRUE(MayAcknowledge(data, Command::kDirection, 16));
  EXPECT_FALSE(MayAcknowledge(data, Command::kDirection, 17));
  EXPECT_FALSE(MayAcknowledge(data, Command::kZero, 16));
  const std::vector<std::uint8_t> refused = {0x22, 0x01};
  EXPECT_FALSE(MayAcknowledge(refused, Command::kDirection, 16));
  EXPECT_TRUE(MayAcknowledge(std::vector<std::uint8_t>{0x20, 0x00}, Command::kZero, 26));
  EXPECT_FALSE(MayAcknowledge(std::vector<std::uint8_t>{0x20}, Command::kZero, 10));
}

TEST(SaaCanCodec, OtherCommandsAreNone) {
  EXPECT_FALSE(ParseRequest(std::vector<std::uint8_t>{0x21, 0x20}));
  EXPECT_FALSE(ParseRequest(std::vector<std::uint8_t>{0x20}));
  EXPECT_FALSE(ParseServiceReply(std::vector<std::uint8_t>{0x04, 0x00}));
  EXPECT_FALSE(ParseServiceReply(std::vector<std::uint8_t>{0x11}));
  const std::optional<Request> request = ParseRequest(std::vector<std::uint8_t>{0x31, 0xFF, 0x0A});
  ASSERT_TRUE(request);
  EXPECT_EQ(request->command, Command::kPeriod);
  EXPECT_EQ(request->node, 0xFF);
  EXPECT_EQ(request->parameter, 10);
}

TEST(SaaCanCodec, AFrameHasAtLeastTheBytesThatItsMeaningNeeds) {
  const std::vector<std::uint8_t> read = {static_cast<std::uint8_t>(Command::kRead), 0x20};
  const std::optional<Request> request = ParseRequest(read);
  ASSERT_TRUE(request);
  EXPECT_EQ(request->parameter, 0) << "a frame of two bytes has none";
  EXPECT_FALSE(ParseRequest(Bytes(read).first(1)));

  const std::vector<std::uint8_t> node = {static_cast<std::uint8_t>(Service::kNode), 0x21};
  const std::optional<ServiceReply> reply = ParseServiceReply(node);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->service, Service::kNode);
  EXPECT_FALSE(ParseServiceReply(Bytes(node).first(1)));
  EXPECT_TRUE(SetsParameter(Bytes(node).first(1)));
  EXPECT_FALSE(SetsParameter({}));
}

}  // namespace
}  // namespace axlecast::saa_can
