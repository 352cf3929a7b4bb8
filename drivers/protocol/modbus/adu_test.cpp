// Against the public documents (Modbus over Serial Line V1.02, Application Protocol V1.1b3), the SAA manual 5.1.7,
// and frames that pymodbus 3.0.0 (Debian python3-pymodbus) built from the documents' register values.
#include "drivers/protocol/modbus/adu.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/golden_file.h"

namespace axlecast::modbus {
namespace {

std::vector<std::uint8_t> Vector(const Frame& frame) { return {frame.data(), frame.data() + frame.size()}; }
std::vector<std::uint8_t> Hex(const std::string& text) { return GoldenBytes(text); }

// Serial Line V1.02, 6.2.2, as its steps read: one bit after the other.
std::uint16_t NaiveCrc(Bytes bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      const bool moved_out = (crc & 1U) != 0;
      crc >>= 1U;
      if (moved_out) crc ^= 0xA001U;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

TEST(Adu, CrcOfTheDocuments) {
  EXPECT_EQ(Crc16(Hex("02 07")), 0x1241);                       // Serial Line V1.02, 6.2.2
  EXPECT_EQ(Crc16(Hex("31 32 33 34 35 36 37 38 39")), 0x4B37);  // CRC-16/MODBUS check value
  EXPECT_EQ(Crc16({}), 0xFFFF);
}

TEST(Adu, CrcAgreesWithTheNaiveOne) {
  std::vector<std::uint8_t> bytes;
  for (unsigned i = 0; i < 256; ++i) {
    bytes.push_back(static_cast<std::uint8_t>(i * 167 + 13));
    EXPECT_EQ(Crc16(bytes), NaiveCrc(bytes));
    EXPECT_EQ(Crc16(Bytes(bytes).last(1)), NaiveCrc(Bytes(bytes).last(1)));
  }
}

TEST(Adu, SealedFramesOfTheSaaManual) {
  EXPECT_EQ(Vector(Sealed({0x01, 0x03, 0x00, 0x00, 0x00, 0x01})), Hex("01 03 00 00 00 01 84 0A"));
  EXPECT_EQ(Vector(Sealed({0x01, 0x03, 0x00, 0x00, 0x00, 0x02})), Hex("01 03 00 00 00 02 C4 0B"));
  EXPECT_EQ(Vector(Sealed({0xFF, 0xA0})), Hex("FF A0 40 38"));
}

TEST(Adu, IsSealedNeedsTheLowByteFirst) {
  EXPECT_TRUE(IsSealed(Hex("01 03 00 00 00 01 84 0A")));
  EXPECT_FALSE(IsSealed(Hex("01 03 00 00 00 01 0A 84")));
  EXPECT_TRUE(IsSealed(Hex("FF A0 40 38")));
  EXPECT_FALSE(IsSealed(Hex("FF FF")));  // the CRC of nothing
  EXPECT_FALSE(IsSealed(Hex("01 7E 80")));
  EXPECT_FALSE(IsSealed({}));
}

TEST(Adu, RequestsAsPymodbusBuildsThem) {
  EXPECT_EQ(Vector(Read(0x03, Function::kReadCoils, 0x13, 0x13)), Hex("03 01 00 13 00 13 8D E0"));
  EXPECT_EQ(Vector(Read(0x04, Function::kReadDiscreteInputs, 0xC4, 0x16)), Hex("04 02 00 C4 00 16 B8 6C"));
  EXPECT_EQ(Vector(Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3)), Hex("11 03 00 6B 00 03 76 87"));
  EXPECT_EQ(Vector(Read(0x02, Function::kReadInputRegisters, 8, 1)), Hex("02 04 00 08 00 01 B0 3B"));
  EXPECT_EQ(Vector(WriteCoil(0x05, 0xAC, true)), Hex("05 05 00 AC FF 00 4D 9F"));
  EXPECT_EQ(Vector(WriteCoil(0x05, 0xAC, false)), Hex("05 05 00 AC 00 00 0C 6F"));
  EXPECT_EQ(Vector(WriteRegister(0x06, 1, 3)), Hex("06 06 00 01 00 03 99 BC"));
  const std::vector<std::uint16_t> values = {10, 0x102};
  EXPECT_EQ(Vector(WriteRegisters(0x07, 1, values)), Hex("07 10 00 01 00 02 04 00 0A 01 02 8C B8"));
}

TEST(Adu, TheLongestWriteFitsAFrame) {
  const std::vector<std::uint16_t> values(123, 0xFFFF);
  const Frame frame = WriteRegisters(1, 0, values);
  EXPECT_EQ(frame.size(), 255U);
  EXPECT_EQ(frame.data()[6], 246) << "the byte count: two for each register (Application Protocol V1.1b3, 6.12)";
  EXPECT_TRUE(IsSealed(frame));
}

TEST(Adu, RepliesAsPymodbusBuildsThem) {
  const auto registers = Hex("11 03 06 02 2B 00 00 00 64 C8 BA");
  const Reply read = Check(Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3), registers);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read.data.size(), 6U);
  EXPECT_EQ(read.Register(0), 0x022B);
  EXPECT_EQ(read.Register(1), 0);
  EXPECT_EQ(read.Register(2), 0x64);

  const auto inputs = Hex("02 04 02 00 0A 7D 37");
  EXPECT_EQ(Check(Read(0x02, Function::kReadInputRegisters, 8, 1), inputs).Register(0), 10);

  const auto coils = Hex("03 01 03 CD 6B 05 43 60");  // Application Protocol V1.1b3, 6.1: coils 20-38
  const Reply bits = Check(Read(0x03, Function::kReadCoils, 0x13, 0x13), coils);
  ASSERT_TRUE(bits.ok());
  EXPECT_TRUE(bits.Bit(0));    // coil 20
  EXPECT_FALSE(bits.Bit(1));   // coil 21
  EXPECT_TRUE(bits.Bit(7));    // coil 27
  EXPECT_TRUE(bits.Bit(18));   // coil 38
  EXPECT_FALSE(bits.Bit(17));  // coil 37

  EXPECT_TRUE(Check(WriteCoil(0x05, 0xAC, true), Hex("05 05 00 AC FF 00 4D 9F")).ok());
  const std::vector<std::uint16_t> values = {10, 0x102};
  EXPECT_TRUE(Check(WriteRegisters(0x07, 1, values), Hex("07 10 00 01 00 02 10 6E")).ok());
}

// Application Protocol V1.1b3, 6.1: 1 to 2,000 coils, 8 in a byte; the last byte is filled with zeros.
TEST(Adu, TheByteCountOfCoils) {
  std::vector<std::uint8_t> reply = {0x03, 0x01, 250};
  reply.resize(253, 0x55);
  const std::uint16_t crc = Crc16(reply);
  reply.push_back(static_cast<std::uint8_t>(crc));
  reply.push_back(static_cast<std::uint8_t>(crc >> 8U));
  EXPECT_EQ(Check(Read(0x03, Function::kReadCoils, 0, 2'000), reply).data.size(), 250U);
  EXPECT_EQ(Check(Read(0x03, Function::kReadCoils, 0, 1'992), reply).error, ErrorKind::kRange);
  const Frame two = Sealed({0x03, 0x01, 2, 0x55, 0x55});
  EXPECT_TRUE(Check(Read(0x03, Function::kReadCoils, 0, 16), two).ok());
  EXPECT_TRUE(Check(Read(0x03, Function::kReadCoils, 0, 9), two).ok());
  EXPECT_EQ(Check(Read(0x03, Function::kReadCoils, 0, 17), two).error, ErrorKind::kRange);
  EXPECT_EQ(Check(Read(0x03, Function::kReadCoils, 0, 8), two).error, ErrorKind::kRange);
}

TEST(Adu, ReportServerIdWithByteCount) {
  const Frame request = Sealed({0x01, 0x11});
  const Frame reply = Sealed({0x01, 0x11, 0x03, 0x41, 0x42, 0xFF});
  const Reply checked = Check(request, reply);
  ASSERT_TRUE(checked.ok());
  EXPECT_EQ(checked.data[0], 0x41);
  EXPECT_EQ(checked.data.size(), 3U);
}

TEST(Adu, Exceptions) {
  const Reply reply = Check(Read(0x09, Function::kReadHoldingRegisters, 0, 1), Hex("09 83 02 41 33"));
  EXPECT_EQ(reply.error, ErrorKind::kException);
  EXPECT_EQ(reply.exception, 2);
  EXPECT_EQ(Check(Hex("09 03"), Hex("09 83 02 41 33")).error, ErrorKind::kException) << "address and function";
  // The exception of another function is not an answer to this request.
  EXPECT_EQ(Check(Read(0x09, Function::kReadHoldingRegisters, 0, 1), Hex("09 86 04 C2 61")).error,
            ErrorKind::kWrongEcho);
}

TEST(Adu, EachFaultOfAReplyHasItsName) {
  const Frame request = Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3);
  const auto good = Hex("11 03 06 02 2B 00 00 00 64 C8 BA");
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(Check(request, Bytes(good).first(size)).error, ErrorKind::kShort) << size;
  }
  for (std::size_t bit = 8 * 3; bit < 8 * good.size(); ++bit) {  // from the first data byte on
    auto damaged = good;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_EQ(Check(request, damaged).error, ErrorKind::kChecksum) << bit;
  }
  EXPECT_EQ(Check(Read(0x12, Function::kReadHoldingRegisters, 0x6B, 3), good).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check(Read(0x11, Function::kReadInputRegisters, 0x6B, 3), good).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check(Read(0x11, Function::kReadHoldingRegisters, 0x6B, 2), good).error, ErrorKind::kRange);
  // A good CRC after more bytes than the byte count.
  EXPECT_EQ(Check(request, Sealed({0x11, 0x03, 0x02, 0x02, 0x2B, 0x00, 0x00})).error, ErrorKind::kRange);
  auto longer = good;
  longer.push_back(1);
  EXPECT_EQ(Check(request, longer).error, ErrorKind::kChecksum);
  longer.back() = 0;  // this CRC does not see zeros behind a frame
  EXPECT_EQ(Check(request, longer).error, ErrorKind::kRange);
}

TEST(Adu, WritesNeedTheirOwnEcho) {
  const auto echo = Hex("06 06 00 01 00 03 99 BC");
  EXPECT_TRUE(Check(WriteRegister(6, 1, 3), echo).ok());
  EXPECT_EQ(Check(WriteRegister(6, 1, 4), echo).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check(WriteRegister(6, 2, 3), echo).error, ErrorKind::kWrongEcho);
  const auto coil = Hex("05 05 00 AC FF 00 4D 9F");
  EXPECT_EQ(Check(WriteCoil(5, 0xAC, false), coil).error, ErrorKind::kWrongEcho);
}

TEST(Adu, ReplyLengths) {
  EXPECT_EQ(ReplyLength({}), 0U);
  EXPECT_EQ(ReplyLength(Hex("01")), 0U);
  EXPECT_EQ(ReplyLength(Hex("01 03")), 0U);
  EXPECT_EQ(ReplyLength(Hex("01 03 06")), 11U);
  EXPECT_EQ(ReplyLength(Hex("01 01 03")), 8U);
  EXPECT_EQ(ReplyLength(Hex("01 11 03")), 8U);
  EXPECT_EQ(ReplyLength(Hex("01 04 FA")), 255U);
  EXPECT_EQ(ReplyLength(Hex("01 04 FB")), 256U);  // the longest ADU (Serial Line V1.02, 2.5.1)
  EXPECT_EQ(ReplyLength(Hex("01 04 FC")), 5U);    // no ADU is that long
  EXPECT_EQ(ReplyLength(Hex("01 04 FF")), 5U);
  for (const char* echo : {"01 05", "01 06", "01 0F", "01 10"}) EXPECT_EQ(ReplyLength(Hex(echo)), 8U) << echo;
  for (const char* other : {"01 83", "01 90", "01 00", "01 2B"}) EXPECT_EQ(ReplyLength(Hex(other)), 5U) << other;
}

TEST(Adu, OfAnUnknownRequestNothingIsAccepted) {
  const Frame request = Sealed({0x01, 0xCC, 0x02});
  EXPECT_EQ(Check(request, Sealed({0x01, 0xCC, 0x02})).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check(Hex("01"), Hex("01 83 02 C0 F1")).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check({}, Hex("01 83 02 C0 F1")).error, ErrorKind::kWrongEcho);
  EXPECT_EQ(Check(Hex("11 03"), Hex("11 03 06 02 2B 00 00 00 64 C8 BA")).error, ErrorKind::kWrongEcho);
}

// `frame` with these bits inverted, counted from the lowest bit of the first byte.
std::vector<std::uint8_t> Inverted(const Frame& frame, const std::vector<std::size_t>& bits) {
  auto bytes = Vector(frame);
  for (const std::size_t bit : bits) bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
  return bytes;
}

TEST(Adu, AReplyMatchesItsRequest) {
  const Frame request = Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3);
  EXPECT_EQ(MatchReply(request, Hex("11 03 06 02 2B 00 00 00 64 C8 BA")), ReplyMatch::kYes);
  EXPECT_EQ(MatchReply(request, Sealed({0x11, 0x83, 0x02})), ReplyMatch::kRefusal);
  EXPECT_EQ(MatchReply(request, Sealed({0x12, 0x03, 0x06, 0, 0, 0, 0, 0, 0})), ReplyMatch::kNo)
      << "another address";
  EXPECT_EQ(MatchReply(request, Sealed({0x11, 0x03, 0x04, 0, 0, 0, 0})), ReplyMatch::kNo) << "another count";
  EXPECT_EQ(MatchReply(Hex("11 03 00"), Sealed({0x11, 0x83, 0x02})), ReplyMatch::kNo) << "no whole request";
  const Frame server_id = Sealed({0x01, 0x11});
  EXPECT_EQ(MatchReply(server_id, Sealed({0x01, 0x11, 0x01, 0x41})), ReplyMatch::kYes);
}

TEST(Adu, ADamagedReplyMatchesByItsFirstThreeBytes) {
  const Frame request = Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3);
  const Frame good = Sealed({0x11, 0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64});
  EXPECT_EQ(MatchReply(request, Inverted(good, {24})), ReplyMatch::kDamaged);
  EXPECT_EQ(MatchReply(request, Inverted(good, {0})), ReplyMatch::kNearly);
  EXPECT_EQ(MatchReply(request, Inverted(good, {1, 2})), ReplyMatch::kNearly);
  EXPECT_EQ(MatchReply(request, Inverted(good, {1, 2, 3})), ReplyMatch::kNo);
  EXPECT_EQ(MatchReply(request, Bytes(good).first(6)), ReplyMatch::kDamaged) << "cut off";
  EXPECT_EQ(MatchReply(request, Bytes(good).first(5)), ReplyMatch::kDamaged);
  EXPECT_EQ(MatchReply(request, Bytes(good).first(4)), ReplyMatch::kNo) << "too short to be one";
  const Frame elsewhere = Read(0x11, Function::kReadHoldingRegisters, 0x056B, 3);
  EXPECT_EQ(MatchReply(elsewhere, Inverted(good, {24})), ReplyMatch::kDamaged)
      << "a read does not repeat its address";

  const Frame write = WriteRegister(0x06, 0x0F01, 3);
  EXPECT_EQ(MatchReply(write, write), ReplyMatch::kYes);
  EXPECT_EQ(MatchReply(write, Inverted(write, {40})), ReplyMatch::kDamaged);
  EXPECT_EQ(MatchReply(write, Inverted(write, {16})), ReplyMatch::kNearly);
  const Frame server_id = Sealed({0x01, 0x11, 0x01, 0x41});
  EXPECT_EQ(MatchReply(Sealed({0x01, 0x11}), Inverted(server_id, {24})), ReplyMatch::kNearly)
      << "the request does not give the byte count";
}

TEST(Adu, AShapeHasWhatTheReplyRepeats) {
  const ReplyShape read = ShapeOf(Read(0x11, Function::kReadHoldingRegisters, 0x6B, 3));
  EXPECT_EQ(read.reply, 0x1103'0006U);
  EXPECT_EQ(read.refusal, 0x1183'0000U);
  EXPECT_FALSE(read.exact);
  EXPECT_EQ(read.match, &MatchReply);
  EXPECT_EQ(ShapeOf(Read(0x03, Function::kReadCoils, 0x13, 0x13)).reply, 0x0301'0003U);
  const ReplyShape write = ShapeOf(WriteRegister(0x06, 0x0102, 3));
  EXPECT_EQ(write.reply, 0x0606'0102U);
  EXPECT_EQ(write.refusal, 0x0686'0000U);
  EXPECT_TRUE(write.exact);
  EXPECT_EQ(ShapeOf(Sealed({0x01, 0x11})).reply, 0x0111'0000U);
}

TEST(Adu, AWriteThatIsCutOffHasNoEcho) {
  EXPECT_EQ(Check(Hex("06 06 00 01"), Hex("06 06 00 01 00 03 99 BC")).error, ErrorKind::kWrongEcho);
}

}  // namespace
}  // namespace axlecast::modbus
