// Against the SAA manual 5.1.7, frame by frame: golden/requests.txt and golden/replies.txt.
#include "drivers/saa_modbus/codec.h"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "drivers/protocol/modbus/adu.h"
#include "drivers/saa_modbus/codec_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_modbus {
namespace {

using FrameBytes = std::vector<std::uint8_t>;

FrameBytes List(Bytes frame) { return {frame.begin(), frame.end()}; }

// 5.1.7, "the steps of calculating the CRC code", as they read.
std::uint16_t NaiveCrc(Bytes bytes) {
  unsigned slave = 0xFFFF;  // 1
  for (const std::uint8_t byte : bytes) {
    slave = (slave & 0xFF00U) | ((slave & 0x00FFU) ^ byte);  // 2
    for (int times = 0; times < 8; ++times) {                // 5
      const unsigned moved_out = slave % 2;
      slave /= 2;                           // 3
      if (moved_out == 1) slave ^= 0xA001;  // 4
    }
  }
  return static_cast<std::uint16_t>(slave);  // 7
}

std::string Said(const Request& request) {
  const std::string address = " address=" + std::to_string(request.address);
  switch (request.function) {
    case kReadPosition:
      return "read" + address + " registers=" + std::to_string(request.registers);
    case kQueryAddress:
      return "query";
    case kSetAddress:
      return "set_address" + address + " to=" + std::to_string(request.new_address);
    default:
      break;
  }
  if (const auto baud = BaudOf(request.parameter)) return "set" + address + " baud=" + std::to_string(*baud);
  if (request.parameter == Parameter::kZero) return "set" + address + " zero";
  return "set" + address + (request.parameter == Parameter::kPositive ? " positive" : " negative");
}

TEST(SaaModbusCodec, RequestsOfTheManual) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "requests.txt", 2)) {
    const FrameBytes bytes = GoldenBytes(row.columns[0]);
    const std::optional<Request> request = ParseRequest(bytes);
    EXPECT_EQ(request ? Said(*request) : "-", row.columns[1]) << row.where;
    if (request) {
      EXPECT_EQ(List(Encoded(*request)), bytes) << row.where;
    }
  }
}

std::string Said(const Request& request, const Reply& reply) {
  if (reply.error == ErrorKind::kException) return "error=exception " + std::to_string(reply.exception);
  if (reply.error) return std::string("error=") + ErrorName(*reply.error);
  if (request.function == kReadPosition) return "counts=" + std::to_string(reply.counts);
  return request.function == kQueryAddress ? "address=" + std::to_string(reply.address) : "done";
}

TEST(SaaModbusCodec, RepliesOfTheManual) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "replies.txt", 4)) {
    const std::optional<Request> request = ParseRequest(GoldenBytes(row.columns[0]));
    ASSERT_TRUE(request) << row.where;
    const FrameBytes bytes = GoldenBytes(row.columns[1]);
    EXPECT_EQ(Said(*request, Check(*request, bytes, std::stoi(row.columns[2]))), row.columns[3]) << row.where;
  }
}

// A reply is complete at the length that the golden file shows, and not a byte sooner.
TEST(SaaModbusCodec, TheLengthOfAReplyFollowsFromItsFirstBytes) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "replies.txt", 4)) {
    if (row.columns[3] == "error=short") continue;
    FrameBytes bytes = GoldenBytes(row.columns[1]);
    if (row.columns[1].ends_with("F8 34 00")) bytes.pop_back();
    for (std::size_t count = 0; count <= bytes.size(); ++count) {
      const std::size_t length = ReplyLength(Bytes(bytes).first(count));
      EXPECT_TRUE(length == bytes.size() || (length == 0 && count < 3)) << row.where << ' ' << count;
    }
  }
}

// 5.1.7 (4): only a reading has a byte count; every other reply has its length by its function.
TEST(SaaModbusCodec, TheFunctionAloneIsTheLengthOfEachReplyButAReading) {
  EXPECT_EQ(ReplyLength(GoldenBytes("01")), 0U);
  EXPECT_EQ(ReplyLength(GoldenBytes("01 03")), 0U);
  EXPECT_EQ(ReplyLength(GoldenBytes("01 CC")), 5U);
  EXPECT_EQ(ReplyLength(GoldenBytes("01 A1")), 4U);
}

TEST(SaaModbusCodec, ADamagedHeadEndsAtOnce) {
  for (unsigned function = 0; function < 256; ++function) {
    for (unsigned third = 0; third < 256; ++third) {
      const FrameBytes head = {1, static_cast<std::uint8_t>(function), static_cast<std::uint8_t>(third)};
      const bool position = function == kReadPosition && third >= 2 && third <= 4;
      EXPECT_EQ(ReplyLength(head), position ? 5 + third : function == kSetAddress ? 4U : 5U);
    }
  }
}

TEST(SaaModbusCodec, CrcAfterTheManualsSteps) {
  std::mt19937 random(1);
  for (int i = 0; i < 2'000; ++i) {
    FrameBytes bytes(1 + random() % 12);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const std::uint16_t crc = NaiveCrc(bytes);
    EXPECT_EQ(modbus::Crc16(bytes), crc);
    FrameBytes msb_first = bytes;
    msb_first.push_back(static_cast<std::uint8_t>(crc >> 8U));
    msb_first.push_back(static_cast<std::uint8_t>(crc));
    EXPECT_EQ(IsSealedEitherWay(msb_first), msb_first.size() >= 4);
    std::swap(msb_first.back(), msb_first[msb_first.size() - 2]);
    EXPECT_EQ(IsSealedEitherWay(msb_first), msb_first.size() >= 4);
    if (bytes.size() < 2) continue;
    msb_first.back() ^= 0x10;
    EXPECT_FALSE(IsSealedEitherWay(msb_first));
  }
}

// A CRC of 16 bits with this polynomial finds every error of up to 3 bits in frames as short as these.
// Encoders of 17 to 24 bits may answer two registers with three bytes: that, too, is the request's own reply, whole or damaged.
TEST(SaaModbusCodec, AReplyOfThreeBytesEndsTheWaitForItsRequest) {
  const Frame two = ReadRequest(1, 2);
  const auto match = ReplyShapeOf(two).match;
  std::vector<std::uint8_t> reply = {0x01, 0x03, 0x03, 0x01, 0xE2, 0x40, 0x5D, 0x1E};  // golden/replies.txt
  EXPECT_EQ(match(two, reply), ReplyMatch::kYes);
  EXPECT_EQ(match(ReadRequest(1, 1), reply), ReplyMatch::kNo);
  EXPECT_EQ(match(ReadRequest(2, 2), reply), ReplyMatch::kNo);
  reply.back() ^= 0x01;
  EXPECT_EQ(match(two, reply), ReplyMatch::kDamaged);
}

TEST(SaaModbusCodec, NoReplyWithUpToThreeWrongBitsIsRead) {
  for (const char* text : {"01 03 02 01 7F F8 34", "01 03 04 00 03 0D 40 0F 53"}) {
    const FrameBytes good = GoldenBytes(text);
    const Request asked{.address = 1, .registers = static_cast<std::uint8_t>(good[2] / 2)};
    const std::size_t bits = 8 * good.size();
    const auto flip = [](FrameBytes& bytes, std::size_t bit) {
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
    };
    for (std::size_t a = 0; a < bits; ++a) {
      for (std::size_t b = a; b < bits; ++b) {
        for (std::size_t c = b; c < bits; ++c) {
          FrameBytes bad = good;
          flip(bad, a);
          if (b > a) flip(bad, b);
          if (c > b) flip(bad, c);
          if (bad == good) continue;
          ASSERT_FALSE(Check(asked, bad, 26).ok()) << text << ": " << a << ' ' << b << ' ' << c;
        }
      }
    }
  }
}

// (2) and "Definition of Setting" IV to VIII.
TEST(SaaModbusCodec, BaudRatesOfTheManual) {
  const std::vector<std::pair<std::int64_t, int>> rates = {
      {2'400, 0x24}, {4'800, 0x48}, {9'600, 0x96}, {19'200, 0x19}, {57'600, 0x57}};
  ASSERT_EQ(BaudRates().size(), rates.size());
  for (std::size_t i = 0; i < rates.size(); ++i) {
    EXPECT_EQ(BaudRates()[i], rates[i].first);
    EXPECT_EQ(static_cast<int>(*BaudParameter(rates[i].first)), rates[i].second);
  }
  EXPECT_FALSE(BaudParameter(38'400));
  EXPECT_FALSE(BaudParameter(0));
}

TEST(SaaModbusCodec, OnlyZeroAndDirectionMoveTheDatum) {
  const auto moves = [](Bytes bytes) { return ParseRequest(bytes)->moves_datum(); };
  EXPECT_TRUE(moves(SetParameterRequest(1, Parameter::kZero)));
  EXPECT_TRUE(moves(SetParameterRequest(1, Parameter::kPositive)));
  EXPECT_TRUE(moves(SetParameterRequest(1, Parameter::kNegative)));
  EXPECT_FALSE(moves(SetParameterRequest(1, Parameter::kBaud9600)));
  EXPECT_FALSE(moves(SetAddressRequest(1, 2)));
  EXPECT_FALSE(moves(ReadRequest(1, 1)));
  EXPECT_TRUE(ParseRequest(SetAddressRequest(1, 2))->writes());
  EXPECT_TRUE(ParseRequest(SetParameterRequest(1, Parameter::kBaud9600))->writes());
  EXPECT_FALSE(ParseRequest(QueryRequest())->writes());
  EXPECT_FALSE(ParseRequest(ReadRequest(1, 1))->writes());
}

// What is cut short or damaged later may still be recognised as the reply that was waited for.
TEST(SaaModbusCodec, TheBeginOfAReplyIsRecognised) {
  const auto begins = [](const char* request, const char* reply) {
    return BeginsReplyTo(*ParseRequest(GoldenBytes(request)), GoldenBytes(reply));
  };
  EXPECT_TRUE(begins("01 03 00 00 00 01 84 0A", "01 03 02"));
  EXPECT_TRUE(begins("01 03 00 00 00 01 84 0A", "01 83 02"));
  EXPECT_FALSE(begins("01 03 00 00 00 01 84 0A", "01 03 03"));
  EXPECT_FALSE(begins("01 03 00 00 00 01 84 0A", "01 03 04"));
  EXPECT_FALSE(begins("01 03 00 00 00 01 84 0A", "02 03 02"));
  EXPECT_FALSE(begins("01 03 00 00 00 01 84 0A", "01 03"));
  EXPECT_TRUE(begins("01 03 00 00 00 02 C4 0B", "01 03 04"));
  EXPECT_TRUE(begins("01 03 00 00 00 02 C4 0B", "01 03 03"));
  EXPECT_FALSE(begins("01 03 00 00 00 02 C4 0B", "01 03 02"));
  EXPECT_TRUE(begins("01 A1 02 D8 51", "02 A1 00"));
  EXPECT_FALSE(begins("01 A1 02 D8 51", "01 A1 00"));
  EXPECT_TRUE(begins("01 CC 02 F4 C1", "01 CC 00"));
  EXPECT_FALSE(begins("01 CC 02 F4 C1", "01 03 02"));
}

// (4): two bytes, or three bytes, MSB first: three only for 17 to 24 bits, and only where two registers were read.
TEST(SaaModbusCodec, ThreeBytesAnswerTwoRegistersOnly) {
  const auto check = [](int registers, const Frame& reply, int bits) {
    return Check(*ParseRequest(ReadRequest(1, registers)), reply, bits).error;
  };
  const Frame three = modbus::Sealed({0x01, 0x03, 0x03, 0x01, 0x02, 0x03});
  const Frame two = modbus::Sealed({0x01, 0x03, 0x02, 0x01, 0x02});
  EXPECT_EQ(check(2, three, 20), std::nullopt);
  EXPECT_EQ(check(1, three, 20), ErrorKind::kWrongEcho);
  EXPECT_EQ(check(2, two, 20), ErrorKind::kWrongEcho);
  EXPECT_EQ(check(2, three, 16), ErrorKind::kWrongEcho);
  EXPECT_EQ(check(2, three, 25), ErrorKind::kWrongEcho);
}

TEST(SaaModbusCodec, ARequestReadsFromRegisterZero) {
  EXPECT_FALSE(ParseRequest(modbus::Sealed({0x01, 0x03, 0x01, 0x00, 0x00, 0x01})));
  EXPECT_FALSE(ParseRequest(modbus::Sealed({0x01, 0x03, 0x00, 0x01, 0x00, 0x01})));
  EXPECT_FALSE(ParseRequest(modbus::Sealed({0x01, 0x03, 0x00, 0x00, 0x01, 0x01})));
}

TEST(SaaModbusCodec, OnlyAQueryIsAnsweredWithTheCrcEitherWay) {
  const auto swapped = [](const Frame& frame) {
    std::vector<std::uint8_t> bytes(frame.data(), frame.data() + frame.size());
    std::swap(bytes[bytes.size() - 1], bytes[bytes.size() - 2]);
    return bytes;
  };
  const auto reply = swapped(modbus::Sealed({kEveryone, kQueryAddress, 0x05}));
  EXPECT_EQ(Check(*ParseRequest(QueryRequest()), reply, 16).address, 5);
  EXPECT_TRUE(Check(*ParseRequest(QueryRequest()), modbus::Sealed({kEveryone, 0xCC, 0x00}), 16).error)
      << "another function, sealed as usual";
  const auto other = swapped(modbus::Sealed({0x01, kQueryAddress, 0x05}));
  EXPECT_EQ(Check(*ParseRequest(ReadRequest(1, 1)), other, 16).error, ErrorKind::kChecksum);
}

TEST(SaaModbusCodec, AReplyMatchesItsRequest) {
  const Frame one = ReadRequest(1, 1);
  const Frame two = ReadRequest(1, 2);
  EXPECT_EQ(MatchReply(one, modbus::Sealed({0x01, 0x03, 0x02, 0x01, 0x02})), ReplyMatch::kYes);
  EXPECT_EQ(MatchReply(two, modbus::Sealed({0x01, 0x03, 0x03, 0x01, 0x02, 0x03})), ReplyMatch::kYes);
  EXPECT_EQ(MatchReply(two, modbus::Sealed({0x01, 0x03, 0x04, 0xFF, 0xFF, 0xFF, 0xFF})), ReplyMatch::kYes)
      << "the resolution belongs to the content";
  EXPECT_EQ(MatchReply(one, modbus::Sealed({0x01, 0x83, 0x02})), ReplyMatch::kRefusal);
  EXPECT_EQ(MatchReply(one, modbus::Sealed({0x02, 0x03, 0x02, 0x01, 0x02})), ReplyMatch::kNo);
  EXPECT_EQ(MatchReply(one, modbus::Sealed({0x01, 0x03, 0x02, 0x01, 0x02, 0x00})), ReplyMatch::kNo) << "too long";
  EXPECT_EQ(MatchReply(one, std::vector<std::uint8_t>{0x01, 0x03}), ReplyMatch::kNo) << "too short";
  EXPECT_EQ(MatchReply(two, std::vector<std::uint8_t>{0x01, 0x03}), ReplyMatch::kNo);
  EXPECT_EQ(MatchReply(modbus::Sealed({0x01, 0x02, 0x03}), modbus::Sealed({0x01, 0x02, 0x03})), ReplyMatch::kNo)
      << "no request of the manual";
}

TEST(SaaModbusCodec, ADamagedReplyMatchesByItsFirstThreeBytes) {
  const auto damaged = [](const Frame& request, const Frame& frame) {
    std::vector<std::uint8_t> bytes(frame.data(), frame.data() + frame.size());
    bytes.back() = static_cast<std::uint8_t>(bytes.back() ^ 0x10U);
    return MatchReply(request, bytes);
  };
  EXPECT_EQ(damaged(ReadRequest(1, 1), modbus::Sealed({0x01, 0x03, 0x02, 0x01, 0x02})), ReplyMatch::kDamaged);
  EXPECT_EQ(damaged(ReadRequest(1, 1), modbus::Sealed({0x01, 0x03, 0x03, 0x01, 0x02, 0x03})), ReplyMatch::kNearly);
  EXPECT_EQ(damaged(ReadRequest(1, 2), modbus::Sealed({0x01, 0x03, 0x04, 0x00, 0x01, 0x02, 0x03})),
            ReplyMatch::kDamaged);
  EXPECT_EQ(damaged(ReadRequest(1, 2), modbus::Sealed({0x01, 0x03, 0x03, 0x01, 0x02, 0x03})), ReplyMatch::kDamaged);
  EXPECT_EQ(damaged(SetParameterRequest(1, Parameter::kZero), SetParameterRequest(1, Parameter::kZero)),
            ReplyMatch::kDamaged);
}

TEST(SaaModbusCodec, AShapeHasWhatTheReplyRepeats) {
  const ReplyShape read = ReplyShapeOf(ReadRequest(1, 2));
  EXPECT_EQ(read.reply, 0x0103'0002U);
  EXPECT_EQ(read.refusal, 0x0183'0000U);
  EXPECT_FALSE(read.exact);
  const ReplyShape zero = ReplyShapeOf(SetParameterRequest(1, Parameter::kZero));
  EXPECT_EQ(zero.reply, 0x01CC'0000U | static_cast<std::uint32_t>(Parameter::kZero));
  EXPECT_EQ(zero.refusal, zero.reply) << "writes are not refused";
  EXPECT_TRUE(zero.exact);
  EXPECT_EQ(ReplyShapeOf(SetAddressRequest(1, 2)).reply >> 16U, 0x02A1U) << "from its new address";
}

}  // namespace
}  // namespace axlecast::saa_modbus
