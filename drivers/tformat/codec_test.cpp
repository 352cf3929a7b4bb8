// The tables of the maker's document (seed: TS5669 N127, chapter 6) and of TI's description (TIDM-1011, tables 2-3
// to 2-7), written out once more here, so that the codec is held against the documents and not against itself.
#include "drivers/tformat/codec.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace axlecast::tformat {
namespace {

std::vector<std::uint8_t> Vector(const Frame& frame) { return {frame.data(), frame.data() + frame.size()}; }

// ---- TS5669 spec 6.3.1, Figure 4 and Table 1 ----

struct Table1Row {
  unsigned id;
  std::array<unsigned, 5> code;  // cc0 cc1 cc2 cc3, parity cc4
};
constexpr std::array<Table1Row, 9> kTable1 = {{{0x0, {0, 0, 0, 0, 0}},
                                               {0x1, {1, 0, 0, 0, 1}},
                                               {0x2, {0, 1, 0, 0, 1}},
                                               {0x3, {1, 1, 0, 0, 0}},
                                               {0x6, {0, 1, 1, 0, 0}},
                                               {0xD, {1, 0, 1, 1, 1}},
                                               {0x7, {1, 1, 1, 0, 1}},
                                               {0x8, {0, 0, 0, 1, 1}},
                                               {0xC, {0, 0, 1, 1, 0}}}};

// The field's eight data bits in the order of the wire: sink code 0 1 0, then cc0 to cc4.
std::uint8_t FieldFromWire(const Table1Row& row) {
  const std::array<unsigned, 8> wire = {0, 1, 0, row.code[0], row.code[1], row.code[2], row.code[3], row.code[4]};
  unsigned field = 0;
  for (std::size_t i = 0; i < wire.size(); ++i) field |= wire[i] << i;  // LSB first
  return static_cast<std::uint8_t>(field);
}

TEST(Codec, Table1ControlFieldsBitByBit) {
  for (const Table1Row& row : kTable1) {
    const auto id = static_cast<DataId>(row.id);
    EXPECT_EQ(ControlField(id), FieldFromWire(row)) << "ID " << row.id;
    EXPECT_EQ(ParseControlField(FieldFromWire(row)), id);
  }
  EXPECT_EQ(kDataIds.size(), kTable1.size());
}

TEST(Codec, EveryOtherControlFieldIsRefused) {
  std::map<std::uint8_t, unsigned> known;
  for (const Table1Row& row : kTable1) known[FieldFromWire(row)] = row.id;
  for (unsigned field = 0; field < 256; ++field) {
    const auto byte = static_cast<std::uint8_t>(field);
    EXPECT_EQ(ParseControlField(byte).has_value(), known.contains(byte)) << field;
  }
}

// A flipped sink code, ID or parity bit never turns one ID into another.
TEST(Codec, OneFlippedBitOfAControlFieldIsSeen) {
  for (const Table1Row& row : kTable1) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      EXPECT_FALSE(ParseControlField(static_cast<std::uint8_t>(FieldFromWire(row) ^ 1U << bit))) << row.id;
    }
  }
}

// ---- Lengths: spec 6.2, Table 2 and 6.3.5; TI tables 2-4 (requests), 2-5 and 2-7 (replies) ----

TEST(Codec, LengthsOfRequestsAndReplies) {
  struct Lengths {
    DataId id;
    std::size_t request;
    std::size_t reply;
  };
  for (const Lengths& row : std::array<Lengths, 9>{{{DataId::kSingleTurn, 1, 6},
                                                    {DataId::kMultiTurn, 1, 6},
                                                    {DataId::kEncoderId, 1, 4},
                                                    {DataId::kAll, 1, 11},
                                                    {DataId::kClearErrors, 1, 6},
                                                    {DataId::kZeroSingleTurn, 1, 6},
                                                    {DataId::kResetTurnsAndErrors, 1, 6},
                                                    {DataId::kEepromWrite, 4, 4},
                                                    {DataId::kEepromRead, 3, 4}}}) {
    const Frame request = row.id == DataId::kEepromWrite  ? EepromWriteRequest(5, 0)
                          : row.id == DataId::kEepromRead ? EepromReadRequest(5)
                                                          : Request(row.id);
    EXPECT_EQ(request.size(), row.request);
    EXPECT_EQ(RequestSize(row.id), row.request);
    EXPECT_EQ(ReplySize(row.id), row.reply);
    const std::vector<std::uint8_t> sent = Vector(request);
    for (std::size_t length = 4; length <= 12; ++length) {
      std::vector<std::uint8_t> reply(length, 0);
      reply[0] = sent[0];
      if (sent.size() > 1) reply[1] = sent[1];  // the cell
      reply.back() = static_cast<std::uint8_t>(reply[0] ^ reply[1]);
      const ReplyError error = ParseReply(sent, reply, Format{}).error;
      // Eleven bytes may be ID 3's data, the answer to an abnormal request (Tables 5 and 6).
      if (length == 11 && row.reply != 11) continue;
      EXPECT_EQ(error, length < row.reply   ? ReplyError::kShort
                       : length > row.reply ? ReplyError::kLong
                                            : ReplyError::kNone)
          << sent[0] << ' ' << length;
    }
  }
  EXPECT_EQ(kLongestReply, 11U);
}

// Spec Table 1 with chapter 9 decides what the resets do: 7 all errors, 8 one revolution, C multi-turn and errors.
// TI's Japanese table 2-2 rotates the three (7 one revolution, 8 multi-turn, C errors); its SDK agrees with the
// maker. An "error clear" that wiped the turns would lose a machine's origin, so the maker's meaning is pinned
// here.
TEST(Codec, ResetIdsMeanWhatTheMakerSays) {
  EXPECT_EQ(Vector(Request(DataId::kClearErrors)), std::vector<std::uint8_t>{0xBA});          // ID 7
  EXPECT_EQ(Vector(Request(DataId::kZeroSingleTurn)), std::vector<std::uint8_t>{0xC2});       // ID 8
  EXPECT_EQ(Vector(Request(DataId::kResetTurnsAndErrors)), std::vector<std::uint8_t>{0x62});  // ID C
}

// ---- Table 2 and TI table 2-5: which bytes hold what ----

Reply Parse(std::vector<std::uint8_t> request, std::vector<std::uint8_t> reply) {
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : reply) sum ^= byte;
  reply.push_back(sum);
  return ParseReply(request, reply, Format{.single_turn_bits = 24, .multi_turn_bits = 24});
}

TEST(Codec, Table2PlacesEveryByte) {
  const Reply all = Parse({0x1A}, {0x1A, 0x00, 0xA0, 0xA1, 0xA2, 0x11, 0xB0, 0xB1, 0xB2, 0x00});
  ASSERT_EQ(all.error, ReplyError::kNone);
  EXPECT_EQ(all.single_turn, 0xA2A1A0U);
  EXPECT_EQ(all.encoder_id, 0x11);
  EXPECT_EQ(all.multi_turn, 0xB2B1B0U);
  const std::array<std::uint8_t, 4> absolute = {0x02, 0xBA, 0xC2, 0x62};  // IDs 0, 7, 8, C
  for (const std::uint8_t field : absolute) {
    const Reply reply = Parse({field}, {field, 0x00, 0xA0, 0xA1, 0xA2});
    EXPECT_EQ(reply.error, ReplyError::kNone);
    EXPECT_EQ(reply.single_turn, 0xA2A1A0U);
    EXPECT_FALSE(reply.multi_turn || reply.encoder_id || reply.alarms);
  }
  const Reply turns = Parse({0x8A}, {0x8A, 0x00, 0xB0, 0xB1, 0xB2});
  EXPECT_EQ(turns.multi_turn, 0xB2B1B0U);
  EXPECT_FALSE(turns.single_turn || turns.encoder_id || turns.alarms);
  const Reply identity = Parse({0x92}, {0x92, 0x00, 0x11});
  EXPECT_EQ(identity.encoder_id, 0x11);
  EXPECT_FALSE(identity.single_turn || identity.multi_turn || identity.alarms);
}

// ---- Table 3 and the status field ----

TEST(Codec, Table3AlarmBits) {
  const std::array<std::pair<unsigned, std::uint8_t>, 8> table = {{{0, kAlmOverSpeed},
                                                                   {1, kAlmFullAbsolute},
                                                                   {2, kAlmCountingError},
                                                                   {3, kAlmCounterOverflow},
                                                                   {4, kAlmAlwaysZero},
                                                                   {5, kAlmMultiTurnError},
                                                                   {6, kAlmBatteryError},
                                                                   {7, kAlmBatteryAlarm}}};
  for (const auto& [bit, mask] : table) {
    EXPECT_EQ(mask, 1U << bit);
    const Reply reply = Parse({0x1A}, {0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, static_cast<std::uint8_t>(1U << bit)});
    if (bit == 4) {
      EXPECT_EQ(reply.error, ReplyError::kRange);
    } else {
      EXPECT_EQ(reply.error, ReplyError::kNone) << bit;
      EXPECT_EQ(reply.alarms, mask);
    }
  }
}

// 6.3.2: the field's bits in the order of the wire are four of information, ea0, ea1, ca0, ca1.
TEST(Codec, StatusFieldBits) {
  EXPECT_EQ(kSfInformation, 0x0F);
  EXPECT_EQ(kSfCountingError, 1U << 4U);
  EXPECT_EQ(kSfMultiTurn, 1U << 5U);
  EXPECT_EQ(kSfParity, 1U << 6U);
  EXPECT_EQ(kSfDelimiter, 1U << 7U);
  for (unsigned status = 0; status < 256; ++status) {
    const Reply reply = Parse({0x02}, {0x02, static_cast<std::uint8_t>(status), 1, 2, 3});
    const bool communication = (status & 0xC0U) != 0;
    const bool information = (status & 0x0FU) != 0;
    EXPECT_EQ(reply.error, communication ? ReplyError::kCommunicationAlarm
                           : information ? ReplyError::kRange
                                         : ReplyError::kNone);
    EXPECT_EQ(reply.single_turn.has_value(), reply.error == ReplyError::kNone);
  }
}

// 6.3.3: 17 and 16 valid bits for the TS5669; other encoders have others.
TEST(Codec, BitsAboveTheModelsAreAlwaysZero) {
  for (int bits = 1; bits <= 24; ++bits) {
    for (int bit = 0; bit < 24; ++bit) {
      std::vector<std::uint8_t> reply = {0x02, 0, 0, 0, 0};
      reply[2 + static_cast<std::size_t>(bit / 8)] =
          static_cast<std::uint8_t>(1U << static_cast<unsigned>(bit % 8));
      reply.push_back(static_cast<std::uint8_t>(0x02 ^ reply[2] ^ reply[3] ^ reply[4]));
      const Format format{.single_turn_bits = bits, .multi_turn_bits = bits};
      const ReplyError expected = bit < bits ? ReplyError::kNone : ReplyError::kRange;
      EXPECT_EQ(ParseReply(std::vector<std::uint8_t>{0x02}, reply, format).error, expected);
      reply[0] = 0x8A;  // ID 1: ABM
      reply[5] ^= 0x02 ^ 0x8A;
      EXPECT_EQ(ParseReply(std::vector<std::uint8_t>{0x8A}, reply, format).error, expected);
    }
  }
}

TEST(Codec, NoTurnsAtAll) {
  const Format single{.single_turn_bits = 17, .multi_turn_bits = 0};
  const std::vector<std::uint8_t> request = {0x8A};
  EXPECT_EQ(ParseReply(request, std::vector<std::uint8_t>{0x8A, 0, 0, 0, 0, 0x8A}, single).error,
            ReplyError::kNone);
  EXPECT_EQ(ParseReply(request, std::vector<std::uint8_t>{0x8A, 0, 1, 0, 0, 0x8B}, single).error,
            ReplyError::kRange);
}

// ---- 6.3.5, Table 4: every row, at every address that is open (6.1.1: 0 to 79) ----

TEST(Codec, Table4AtEveryAddress) {
  for (unsigned cell = 0; cell < 80; ++cell) {
    const auto address = static_cast<std::uint8_t>(cell);
    const auto busy = static_cast<std::uint8_t>(0x80U | cell);
    const auto data = static_cast<std::uint8_t>(cell * 3 + 1);
    const std::vector<std::uint8_t> read = Vector(EepromReadRequest(address));
    const std::vector<std::uint8_t> write = Vector(EepromWriteRequest(address, data));
    EXPECT_EQ(read, (std::vector<std::uint8_t>{0xEA, address, static_cast<std::uint8_t>(0xEA ^ address)}));
    EXPECT_EQ(write,
              (std::vector<std::uint8_t>{0x32, address, data, static_cast<std::uint8_t>(0x32 ^ address ^ data)}));
    EXPECT_EQ(Parse(read, {0xEA, address, data}).data, data);
    EXPECT_EQ(Parse(write, {0x32, address, data}).data, data);
    for (const Reply& refused : {Parse(read, {0xEA, busy, 0x00}), Parse(write, {0x32, busy, 0x00})}) {
      EXPECT_EQ(refused.error, ReplyError::kNone);
      EXPECT_EQ(refused.busy, true);
      EXPECT_EQ(refused.address, address);
      EXPECT_FALSE(refused.data);  // 00 is no data
    }
  }
  EXPECT_EQ(kEepromCells, 80);
}

TEST(Codec, EveryErrorHasItsWord) {
  const std::vector<std::string> words = {
      "none", "short", "long", "checksum", "wrong_echo", "communication_alarm", "abnormal_reply", "range"};
  for (std::size_t i = 0; i < words.size(); ++i) EXPECT_EQ(ReplyErrorName(static_cast<ReplyError>(i)), words[i]);
}

// ---- what a reply answers ----

constexpr std::uint8_t kOwnEncoder = 0x11;

std::vector<std::uint8_t> WithCrc(std::vector<std::uint8_t> bytes) {
  bytes.push_back(Crc(bytes));
  return bytes;
}

Answer Interpreted(DataId id, const std::vector<std::uint8_t>& reply, bool echo = false,
                   Event::Kind kind = Event::Kind::kReply) {
  Event event;
  event.kind = kind;
  const Frame request = Request(id);
  event.request = request;
  event.bytes = reply;
  return Interpret(event, {.format = {}, .encoder_id = kOwnEncoder, .echo = echo});
}

ReplyMatch Match(DataId id, const std::vector<std::uint8_t>& reply) {
  const Frame request = Request(id);
  return Ask(id, kMillisecond).shape.match(request, reply);
}

TEST(Codec, AReplyOutOfRangeThatHasNoEncoderIdIsOfNoOtherEncoder) {
  const Answer answer = Interpreted(DataId::kSingleTurn, WithCrc({0x02, 0x01, 0x10, 0x20, 0x00}));
  EXPECT_EQ(answer.error, ErrorKind::kRange) << "a bit of SF that is always 0";
  EXPECT_FALSE(answer.reply.encoder_id);
}

TEST(Codec, ACommunicationAlarmOfAReadoutHasItsIdAndStatus) {
  const Reply reply = Parse({0x92}, {0x92, kSfParity, 0x11});  // ID 2
  EXPECT_EQ(reply.error, ReplyError::kCommunicationAlarm);
  EXPECT_EQ(reply.id, DataId::kEncoderId);
  EXPECT_EQ(reply.status, kSfParity);
}

// Spec 6.3.2: an encoder that misread the request sets ca0 or ca1, and answers with ID 3's data.
TEST(Codec, TheStatusFieldShowsHowLongAReplyIs) {
  using Bytes8 = std::vector<std::uint8_t>;
  for (const auto& [id, field, size] : std::vector<std::tuple<DataId, std::uint8_t, std::size_t>>{
           {DataId::kSingleTurn, 0x02, 6}, {DataId::kEncoderId, 0x92, 4}, {DataId::kZeroSingleTurn, 0xC2, 6}}) {
    const ReplyLength length = Ask(id, kMillisecond).reply_length;
    EXPECT_EQ(length(Bytes8{}), 0U);
    EXPECT_EQ(length(Bytes8{field}), 0U) << "the status field decides";
    EXPECT_EQ(length(Bytes8{field, 0x00}), size);
    EXPECT_EQ(length(Bytes8{field, kSfParity}), kLongestReply);
    EXPECT_EQ(length(Bytes8{field, kSfDelimiter}), kLongestReply);
    EXPECT_EQ(length(Bytes8{0x1A}), kLongestReply) << "ID 3";
  }
  EXPECT_EQ(AskCell(3, kMillisecond).reply_length(Bytes8{0xEA}), 4U);
  EXPECT_EQ(Ask(DataId::kAll, kMillisecond).reply_length(Bytes8{0x1A}), 11U);
}

TEST(Codec, AReplyMatchesItsRequest) {
  const auto good = WithCrc({0x02, 0x00, 0xA0, 0xA1, 0x01});
  EXPECT_EQ(Match(DataId::kSingleTurn, good), ReplyMatch::kYes);
  EXPECT_EQ(Match(DataId::kSingleTurn, WithCrc({0x02, 0x01, 0xA0, 0xA1, 0x01})), ReplyMatch::kYes)
      << "bits that are always 0 belong to the content";
  EXPECT_EQ(Match(DataId::kSingleTurn, WithCrc({0x02, kSfParity, 0, 0, 0})), ReplyMatch::kRefusal);
  EXPECT_EQ(Match(DataId::kSingleTurn, WithCrc({0x1A, 0, 1, 2, 3, kOwnEncoder, 4, 5, 6, 0})), ReplyMatch::kRefusal)
      << "ID 3's data";
  EXPECT_EQ(Match(DataId::kSingleTurn, WithCrc({0xBA, 0x00, 0xA0, 0xA1, 0x01})), ReplyMatch::kNo) << "ID 7";
  EXPECT_EQ(Match(DataId::kSingleTurn, {good.begin(), good.end() - 1}), ReplyMatch::kNo) << "too short";
}

TEST(Codec, ADamagedReplyMatchesByItsControlField) {
  const auto damaged = [](std::uint8_t inverted) {
    auto reply = WithCrc({0x02, 0x00, 0xA0, 0xA1, 0x01});
    reply[0] = static_cast<std::uint8_t>(reply[0] ^ inverted);
    reply[3] = static_cast<std::uint8_t>(reply[3] ^ 0x08U);
    return Match(DataId::kSingleTurn, reply);
  };
  EXPECT_EQ(damaged(0x00), ReplyMatch::kDamaged);
  EXPECT_EQ(damaged(0x01), ReplyMatch::kNearly);
  EXPECT_EQ(damaged(0x03), ReplyMatch::kNearly);
  EXPECT_EQ(damaged(0x07), ReplyMatch::kNo);
  auto another = WithCrc({0x1A, 0x00, 0xA0, 0xA1, 0x01});  // ID 3 instead of ID 0: two bits of the field
  another[3] = static_cast<std::uint8_t>(another[3] ^ 0x08U);
  EXPECT_EQ(Match(DataId::kSingleTurn, another), ReplyMatch::kNearly);
  auto all = WithCrc({0x02, 0, 1, 2, 3, kOwnEncoder, 4, 5, 6, 0});  // ID 0 instead of ID 3
  all[4] = static_cast<std::uint8_t>(all[4] ^ 0x08U);
  EXPECT_EQ(Match(DataId::kAll, all), ReplyMatch::kNearly);
}

TEST(Codec, AShapeHasTheFieldsThatAReplyRepeats) {
  const ReplyShape cell = AskCell(0x4F, kMillisecond).shape;
  EXPECT_EQ(cell.reply, 0x4FEAU) << "address and control field of ID D";
  EXPECT_EQ(cell.refusal, 0x1AU) << "ID 3";
  EXPECT_FALSE(cell.exact);
  const ReplyShape write = WriteCell(0x01, 0xA5, kMillisecond).shape;
  EXPECT_EQ(write.reply, 0x0132U);
  EXPECT_TRUE(write.exact);
  for (const DataId id : kDataIds) {
    if (IsEeprom(id)) continue;
    const ReplyShape shape = Ask(id, kMillisecond).shape;
    EXPECT_EQ(shape.reply, ControlField(id));
    EXPECT_EQ(shape.interchangeable, id == DataId::kEncoderId);
    EXPECT_EQ(shape.exact, IsReset(id));
  }
}

TEST(Codec, ALongReplyIsAnEchoOnlyWhereTheAdapterEchoes) {
  auto longer = WithCrc({0x02, 0x00, 0xA0, 0xA1, 0x01});
  longer.push_back(0x55);
  EXPECT_EQ(Interpreted(DataId::kSingleTurn, longer).error, ErrorKind::kUnexpectedBytes);
  EXPECT_EQ(Interpreted(DataId::kSingleTurn, longer, true).error, ErrorKind::kWrongEcho);
  auto damaged = WithCrc({0x02, 0x00, 0xA0, 0xA1, 0x01});
  damaged[3] = static_cast<std::uint8_t>(damaged[3] ^ 0x08U);
  EXPECT_EQ(Interpreted(DataId::kSingleTurn, damaged, true).error, ErrorKind::kChecksum);
}

TEST(Codec, AnotherModelIsNamedAlsoByBitsThatThisOneNeverSets) {
  const Answer answer = Interpreted(DataId::kEncoderId, WithCrc({0x92, 0x01, 0x17}));
  EXPECT_EQ(answer.error, ErrorKind::kWrongIdentity);
  EXPECT_EQ(answer.reply.encoder_id, 0x17);
  EXPECT_EQ(Interpreted(DataId::kEncoderId, WithCrc({0x92, 0x01, kOwnEncoder})).error, ErrorKind::kRange);
}

TEST(Codec, AReplyThatEndedByItsTimeoutIsShort) {
  const auto whole = WithCrc({0x92, 0x00, kOwnEncoder});
  EXPECT_EQ(Interpreted(DataId::kEncoderId, whole).error, std::nullopt);
  EXPECT_FALSE(Interpreted(DataId::kEncoderId, whole).line_unclear);
  const Answer late = Interpreted(DataId::kEncoderId, whole, false, Event::Kind::kTimeout);
  EXPECT_EQ(late.error, ErrorKind::kShort);
  EXPECT_TRUE(late.line_unclear);
}

}  // namespace
}  // namespace axlecast::tformat
