#include "drivers/protocol/canopen/canopen.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "tests/support/golden_file.h"

namespace axlecast::canopen {
namespace {

using ::testing::HasSubstr;

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

}  // namespace
}  // namespace axlecast::canopen
