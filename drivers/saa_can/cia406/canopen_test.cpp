#include "drivers/saa_can/cia406/canopen.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "core/device/operation.h"
#include "drivers/saa_can/cia406/cia406.h"
#include "drivers/saa_can/cia406/objects.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_can::cia406 {
namespace {

using ::testing::HasSubstr;

std::vector<std::uint8_t> DataOf(std::string text) {
  const std::size_t pad = text.find('+');
  if (pad != std::string::npos) text.erase(pad);
  std::vector<std::uint8_t> data = GoldenBytes(text);
  if (pad != std::string::npos) data.resize(8);
  return data;
}

CanFrame FrameOf(std::uint32_t id, const std::vector<std::uint8_t>& data) {
  CanFrame frame{.id = id, .data = {}};
  frame.data.Append(Bytes(data));
  return frame;
}

nlohmann::ordered_json Decoded(std::uint32_t id, const std::vector<std::uint8_t>& data,
                               const DecodeSettings& settings = {}) {
  bool usable = false;
  return Decode(settings, FrameOf(id, data), &usable);
}

TEST(Cia406Codec, FramesAsOthersPrintThem) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 3)) {
    const auto id = static_cast<std::uint32_t>(std::stoul(row.columns[0], nullptr, 16));
    EXPECT_EQ(Decoded(id, DataOf(row.columns[1])).dump(), row.columns[2]) << row.where;
  }
}

// The requests of the same sources, made by us.
TEST(Cia406Codec, RequestsAreTheDocumentsBytes) {
  const auto text = [](const CanFrame& frame) { return Text("%03X ", frame.id) + HexText(frame.data); };
  EXPECT_EQ(text(RequestFrame(2, {.object = kVendor, .write = {}})), "602 40 18 10 01 00 00 00 00")
      << "python-canopen";
  EXPECT_EQ(text(RequestFrame(46, {.object = {0x1017, 0}, .write = {}})), "62E 40 17 10 00 00 00 00 00")
      << "Applied Motion ST10-C-CE, appendix J";
  EXPECT_EQ(text(RequestFrame(1, {.object = kStoreAll, .write = kSaveSignature})), "601 23 10 10 01 73 61 76 65")
      << "ziehl-abegg AM-CAN-OPEN p. 15";
  EXPECT_EQ(text(RequestFrame(1, {.object = {0x6093, 1}, .write = 0x12345678})), "601 23 93 60 01 78 56 34 12")
      << "Festo CiA 402 p. 20";
  EXPECT_EQ(text(NmtFrame(NmtCommand::kStart, 0x0B)), "000 01 0B") << "EAO series 09 p. 51";
  EXPECT_EQ(text(SyncFrame()), "080 ");
}

TEST(Cia406Codec, AnAbortNamesObjectAndCode) {
  // CiA 301 7.2.4.3.17: command 80, index and sub-index, code little-endian.
  EXPECT_EQ(HexText(AbortFrame(5, kPosition, AbortCode::kTimedOut).data), "80 04 60 00 00 00 04 05");
  const SdoAnswer answer = ParseAnswer(GoldenBytes("80 05 65 00 00 00 02 06"));
  EXPECT_EQ(answer.kind, SdoAnswer::Kind::kAborted);
  EXPECT_EQ(answer.object, kWarnings);
  EXPECT_STREQ(AbortText(answer.value), "object does not exist");
}

TEST(Cia406Codec, AbortCodesOfTable22) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "abort_codes.txt", 2)) {
    const auto code = static_cast<std::uint32_t>(std::stoul(row.columns[0], nullptr, 16));
    EXPECT_THAT(AbortText(code), HasSubstr(row.columns[1])) << row.where;
  }
  EXPECT_STREQ(AbortText(0x1234'5678), "unknown abort code");
}

TEST(Cia406Codec, APositionIsFourBytesLowFirst) {
  const DecodeSettings settings = {{"bits", "13"}, {"turn_bits", "12"}};
  EXPECT_EQ(
      Decoded(0x181, {0x01, 0x10, 0x00, 0x00}, settings).dump(),
      R"({"ok":true,"kind":"position","position":4097,"turns":0,"counts":4097,"angle_deg":180.0439453125,"node":1})");
  EXPECT_EQ(Decoded(0x181, {0x00, 0x00, 0x00, 0x02}, settings)["error"], "range");
  EXPECT_EQ(Decoded(0x181, {0x00, 0x00, 0x00})["error"], "short");
  EXPECT_EQ(Decoded(0x181, {0, 0, 0, 0, 0x01, 0x10})["status"], "0x1001");
  EXPECT_EQ(Decoded(0x2A0, {1, 0, 0, 0}, {{"cob_id", "0x2a0"}})["position"], 1);
  EXPECT_EQ(Decoded(0x181, {1, 0, 0, 0}, {{"cob_id", "0x2a0"}})["error"], "function");
}

TEST(Cia406Codec, WhatIsNoAnswerIsMalformed) {
  for (const char* text : {"", "43", "43 04 60", "43 04 60 00", "43 04 60 00 01 02 03", "20 04 60 00 00 00 00 00",
                           "C0 04 60 00 00 00 00 00", "80 04 60 00 00 00 04"}) {
    EXPECT_EQ(ParseAnswer(GoldenBytes(text)).kind, SdoAnswer::Kind::kMalformed) << text;
  }
}

// Every command byte of a server: 7.2.4.3.3 (3), 7.2.4.3.6 (2), 7.2.4.3.17 (4).
TEST(Cia406Codec, CommandSpecifiersOfAServer) {
  for (unsigned command = 0; command < 256; ++command) {
    std::vector<std::uint8_t> data = {static_cast<std::uint8_t>(command), 0x04, 0x60, 0, 0xDD, 0xCC, 0xBB, 0xAA};
    const SdoAnswer answer = ParseAnswer(data);
    const bool expedited = (command >> 5) == 2 && (command & 2) != 0;
    EXPECT_EQ(answer.kind == SdoAnswer::Kind::kValue, expedited) << command;
    if (expedited && (command & 1) != 0) {
      const unsigned bytes = 4 - (command >> 2 & 3);
      EXPECT_EQ(answer.value, 0xAABBCCDDU & (bytes == 4 ? ~0U : (1U << 8 * bytes) - 1)) << command;
    }
  }
}

TEST(Cia406Codec, BitSevenOfAHeartbeatIsTheToggleBitOfNodeGuarding) {
  EXPECT_EQ(ParseHeartbeat(GoldenBytes("FF")), NmtState::kPreOperational);
  EXPECT_EQ(ParseHeartbeat(GoldenBytes("85")), NmtState::kOperational);
  EXPECT_EQ(ParseHeartbeat(GoldenBytes("06")), std::nullopt);
  EXPECT_EQ(ParseHeartbeat(GoldenBytes("05 00")), std::nullopt);
}

TEST(Cia406Codec, TheErrorRegister) {
  EXPECT_EQ(ErrorRegisterText(0x00), "none");
  EXPECT_EQ(ErrorRegisterText(0x15), "generic, voltage, communication");
  EXPECT_EQ(ErrorRegisterText(0x80), "manufacturer");
}

TEST(Cia406Codec, ForeignFramesAreNotDescribed) {
  EXPECT_EQ(Decoded(0x580, {0x43, 0, 0, 0, 0, 0, 0, 0})["error"], "wrong_identity") << "no node 0";
  EXPECT_EQ(Decoded(0x585, {0x60, 0, 0, 0}, {{"node", "6"}})["error"], "wrong_identity");
  EXPECT_EQ(Decoded(0x185 | kCanExtended, {0, 0, 0, 0})["error"], "function");
  EXPECT_EQ(Decoded(0x301, {0, 0})["error"], "function");
  EXPECT_EQ(Decoded(0x000, {0x03, 0x01})["error"], "range");
  EXPECT_EQ(Decoded(0x081, {0, 0, 0})["error"], "short");
  EXPECT_EQ(Decoded(0x601, {0x00, 0, 0, 0, 0, 0, 0, 0})["error"], "function") << "a segment";
  bool usable = true;
  EXPECT_THAT(Decode({{"bits", "40"}}, {}, &usable)["error"].get<std::string>(), HasSubstr("bits=40"));
  EXPECT_FALSE(usable);
  EXPECT_THAT(Decode({{"colour", "4"}}, {}, &usable)["error"].get<std::string>(), HasSubstr("colour"));
}

}  // namespace
}  // namespace axlecast::saa_can::cia406
