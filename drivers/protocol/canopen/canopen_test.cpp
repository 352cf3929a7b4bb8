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
    } else if (expedited) {
      EXPECT_EQ(answer.size, 4) << command;
      EXPECT_EQ(answer.value, 0xAABBCCDDU) << command;
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

// Every command byte of a client: 7.2.4.3.3 (1), 7.2.4.3.6 (2).
TEST(Cia406Codec, CommandSpecifiersOfAClient) {
  for (unsigned command = 0; command < 256; ++command) {
    const auto data =
        std::vector<std::uint8_t>{static_cast<std::uint8_t>(command), 0x09, 0x65, 7, 0xDD, 0xCC, 0xBB, 0xAA};
    const std::optional<SdoRequest> request = ParseRequest(data);
    const bool reads = command >> 5 == 2;
    const bool writes = command >> 5 == 1 && (command & 2) != 0;
    ASSERT_EQ(request.has_value(), reads || writes) << command;
    if (!request) continue;
    EXPECT_EQ(request->object, (ObjectId{0x6509, 7})) << command;
    ASSERT_EQ(request->write.has_value(), writes) << command;
    const unsigned bytes = (command & 1) != 0 ? 4 - (command >> 2 & 3) : 4;
    if (writes) {
      EXPECT_EQ(*request->write, 0xAABBCCDDU & (bytes == 4 ? ~0U : (1U << 8 * bytes) - 1)) << command;
    }
    EXPECT_FALSE(ParseRequest(Bytes(data).first(7))) << command;
  }
}

// 7.2.4.3.6: an upload of more than four bytes is segmented; bit 0: bytes 4 to 7 have the size.
TEST(Cia406Codec, ASegmentedUploadGivesItsSizeIfBitZeroIsSet) {
  EXPECT_EQ(ParseAnswer(GoldenBytes("41 08 10 00 09 01 00 00")).kind, SdoAnswer::Kind::kSegmented);
  EXPECT_EQ(ParseAnswer(GoldenBytes("41 08 10 00 09 01 00 00")).value, 0x109U);
  EXPECT_EQ(ParseAnswer(GoldenBytes("40 08 10 00 09 01 00 00")).value, 0U);
  EXPECT_EQ(ParseAnswer(GoldenBytes("41 08 10 00")).kind, SdoAnswer::Kind::kSegmented);
  EXPECT_EQ(ParseAnswer(GoldenBytes("41 08 10 00")).value, 0U);
}

TEST(Cia406Codec, AnswersThatAreNotPaddedNeedTheirAnnouncedData) {
  EXPECT_EQ(ParseAnswer(GoldenBytes("60 04 60 00")).kind, SdoAnswer::Kind::kWritten);
  const SdoAnswer byte = ParseAnswer(GoldenBytes("4F 04 60 00 07"));
  EXPECT_EQ(byte.kind, SdoAnswer::Kind::kValue);
  EXPECT_EQ(byte.size, 1);
  EXPECT_EQ(byte.value, 7U);
}

// 7.2.7.3.1: error code, error register, five bytes of the maker's.
TEST(Cia406Codec, AnEmergencyHasCodeRegisterAndSpecificBytes) {
  const auto emergency = ParseEmergency(GoldenBytes("10 42 09 01 02 03 04 05"));
  ASSERT_TRUE(emergency);
  EXPECT_EQ(emergency->code, 0x4210);
  EXPECT_EQ(emergency->error_register, 0x09);
  EXPECT_THAT(emergency->specific, ::testing::ElementsAre(1, 2, 3, 4, 5));
  EXPECT_FALSE(emergency->IsReset());
  EXPECT_FALSE(ParseEmergency(GoldenBytes("10 42 09 01 02 03 04")));
  EXPECT_FALSE(ParseEmergency(GoldenBytes("10 42 09 01 02 03 04 05 06")));
}

// Table 26.
TEST(Cia406Codec, EmergencyClassesOfTable26) {
  const std::vector<std::pair<std::uint16_t, const char*>> classes = {{0x0000, "no error"},
                                                                      {0x10FF, "generic"},
                                                                      {0x2012, "current"},
                                                                      {0x2110, "input current"},
                                                                      {0x2310, "output current"},
                                                                      {0x3110, "mains voltage"},
                                                                      {0x4100, "ambient temperature"},
                                                                      {0x4200, "device temperature"},
                                                                      {0x4310, "unknown"},
                                                                      {0x5000, "hardware"},
                                                                      {0x5FFF, "hardware"},
                                                                      {0x6010, "software"},
                                                                      {0x6F00, "software"},
                                                                      {0x7012, "additional modules"},
                                                                      {0x8110, "communication"},
                                                                      {0x8210, "protocol"},
                                                                      {0x8310, "monitoring"},
                                                                      {0x8F00, "monitoring"},
                                                                      {0x9001, "external"},
                                                                      {0xA000, "unknown"},
                                                                      {0xFE00, "additional functions"},
                                                                      {0xFF01, "device specific"}};
  for (const auto& [code, name] : classes) EXPECT_STREQ(EmergencyClass(code), name) << code;
}

TEST(Cia406Codec, NamesOfTheNmtStates) {
  EXPECT_STREQ(NmtStateName(NmtState::kBootUp), "boot_up");
  EXPECT_STREQ(NmtStateName(NmtState::kStopped), "stopped");
  EXPECT_STREQ(NmtStateName(NmtState::kOperational), "operational");
  EXPECT_STREQ(NmtStateName(NmtState::kPreOperational), "pre_operational");
}

}  // namespace
}  // namespace axlecast::canopen
