#include "drivers/tformat/codec.h"

#include <cassert>

namespace axlecast::tformat {
namespace {

constexpr std::uint8_t kSfCommunicationAlarm = kSfParity | kSfDelimiter;

// Bit n: ID n is in Table 1.
constexpr unsigned kKnownIds = [] {
  unsigned known = 0;
  for (const DataId id : kDataIds) known |= 1U << static_cast<unsigned>(id);
  return known;
}();

// Three bytes, low byte first (spec 6.3.3: ABS0 and ABM0 are the lower byte of 24 bits).
std::uint32_t Field24(Bytes reply, std::size_t at) {
  return static_cast<std::uint32_t>(reply[at]) | static_cast<std::uint32_t>(reply[at + 1]) << 8U |
         static_cast<std::uint32_t>(reply[at + 2]) << 16U;
}

void AppendField24(Frame& frame, std::uint32_t value) {
  frame.Append(static_cast<std::uint8_t>(value));
  frame.Append(static_cast<std::uint8_t>(value >> 8U));
  frame.Append(static_cast<std::uint8_t>(value >> 16U));
}

bool Fits(std::uint32_t value, int bits) { return value >> static_cast<unsigned>(bits) == 0; }

Reply Failed(ReplyError error) {
  Reply reply;
  reply.error = error;
  return reply;
}

// The data fields of a readout or reset, spec Table 2; kRange when an always-zero bit is set.
Reply ParseData(DataId id, Bytes bytes, const Format& format) {
  Reply reply;
  reply.id = id;
  reply.status = bytes[1];
  bool in_range = (bytes[1] & kSfInformation) == 0;
  switch (id) {
    case DataId::kEncoderId:
      reply.encoder_id = bytes[2];
      break;
    case DataId::kMultiTurn:
      reply.multi_turn = Field24(bytes, 2);
      break;
    case DataId::kAll:
      reply.single_turn = Field24(bytes, 2);
      reply.encoder_id = bytes[5];
      reply.multi_turn = Field24(bytes, 6);
      reply.alarms = bytes[9];
      in_range = in_range && (bytes[9] & kAlmAlwaysZero) == 0;
      break;
    default:
      reply.single_turn = Field24(bytes, 2);
      break;
  }
  in_range = in_range && Fits(reply.single_turn.value_or(0), format.single_turn_bits) &&
             Fits(reply.multi_turn.value_or(0), format.multi_turn_bits);
  return in_range ? reply : Failed(ReplyError::kRange);
}

// ID 3's data to an abnormal request; `bytes` are 11 with a right CRC. The control field is not looked at: what an
// encoder echoes here is not specified.
Reply ParseAnswerToAbnormal(Bytes bytes, const Format& format) {
  Reply reply = ParseData(DataId::kAll, bytes, format);
  if (reply.error != ReplyError::kNone) return reply;
  reply.error =
      (bytes[1] & kSfCommunicationAlarm) != 0 ? ReplyError::kCommunicationAlarm : ReplyError::kAbnormalReply;
  return reply;
}

Reply ParseReadout(DataId id, Bytes bytes, const Format& format) {
  Reply reply = ParseData(id, bytes, format);
  if ((bytes[1] & kSfCommunicationAlarm) != 0) {
    if (id != DataId::kAll || reply.error != ReplyError::kNone) reply = Failed(ReplyError::kCommunicationAlarm);
    reply.error = ReplyError::kCommunicationAlarm;
    reply.id = id;
    reply.status = bytes[1];
    return reply;
  }
  return bytes[0] == ControlField(id) ? reply : Failed(ReplyError::kWrongEcho);
}

// Spec 6.3.5, Table 4.
Reply ParseEeprom(const RequestFields& asked, Bytes bytes) {
  Reply reply;
  reply.id = asked.id;
  reply.address = static_cast<std::uint8_t>(bytes[1] & ~kBusy);
  reply.busy = (bytes[1] & kBusy) != 0;
  if (bytes[0] != ControlField(asked.id) || reply.address != asked.address) return Failed(ReplyError::kWrongEcho);
  if (*reply.busy) return bytes[2] == 0 ? reply : Failed(ReplyError::kRange);
  if (asked.data && bytes[2] != *asked.data) return Failed(ReplyError::kWrongEcho);
  reply.data = bytes[2];
  return reply;
}

void AppendEepromFields(Frame& frame, const Reply& reply) {
  const bool busy = reply.busy.value_or(false);
  frame.Append(static_cast<std::uint8_t>(reply.address.value_or(0) | (busy ? kBusy : 0)));
  frame.Append(busy ? std::uint8_t{0} : reply.data.value_or(0));
}

void AppendDataFields(Frame& frame, const Reply& reply) {
  frame.Append(reply.status.value_or(0));
  switch (reply.id) {
    case DataId::kEncoderId:
      frame.Append(reply.encoder_id.value_or(0));
      break;
    case DataId::kMultiTurn:
      AppendField24(frame, reply.multi_turn.value_or(0));
      break;
    case DataId::kAll:
      AppendField24(frame, reply.single_turn.value_or(0));
      frame.Append(reply.encoder_id.value_or(0));
      AppendField24(frame, reply.multi_turn.value_or(0));
      frame.Append(reply.alarms.value_or(0));
      break;
    default:
      AppendField24(frame, reply.single_turn.value_or(0));
      break;
  }
}

}  // namespace

std::optional<DataId> ParseControlField(std::uint8_t field) {
  const auto id = static_cast<DataId>(field >> 3U & 0x0FU);
  const bool known = (kKnownIds >> static_cast<unsigned>(id) & 1U) != 0;
  if (!known || ControlField(id) != field) return std::nullopt;
  return id;
}

std::uint8_t Crc(Bytes bytes) {
  unsigned sum = 0;
  for (const std::uint8_t byte : bytes) sum ^= byte;
  return static_cast<std::uint8_t>(sum);
}

Frame Request(DataId id) {
  assert(!IsEeprom(id));
  return {ControlField(id)};
}

Frame EepromReadRequest(std::uint8_t address) {
  assert(address < kEepromCells);
  Frame frame{ControlField(DataId::kEepromRead), address};
  frame.Append(Crc(frame));
  return frame;
}

Frame EepromWriteRequest(std::uint8_t address, std::uint8_t data) {
  assert(address < kEepromCells);
  Frame frame{ControlField(DataId::kEepromWrite), address, data};
  frame.Append(Crc(frame));
  return frame;
}

const char* ReplyErrorName(ReplyError error) {
  switch (error) {
    case ReplyError::kNone:
      return "none";
    case ReplyError::kShort:
      return "short";
    case ReplyError::kLong:
      return "long";
    case ReplyError::kChecksum:
      return "checksum";
    case ReplyError::kWrongEcho:
      return "wrong_echo";
    case ReplyError::kCommunicationAlarm:
      return "communication_alarm";
    case ReplyError::kAbnormalReply:
      return "abnormal_reply";
    case ReplyError::kRange:
      return "range";
  }
  return "none";
}

Reply ParseReply(Bytes request, Bytes reply, const Format& format) {
  const std::optional<RequestFields> asked = ParseRequest(request);
  const std::size_t expected = asked ? ReplySize(asked->id) : kLongestReply;
  if (reply.size() < expected) return Failed(ReplyError::kShort);
  if (reply.size() > expected) {
    if (reply.size() != kLongestReply || Crc(reply) != 0) return Failed(ReplyError::kLong);
    const Reply answer = ParseAnswerToAbnormal(reply, format);
    return answer.error == ReplyError::kRange ? Failed(ReplyError::kLong) : answer;
  }
  // The CRC is the XOR of all bytes before it, so that the XOR of a whole reply is 0.
  if (Crc(reply) != 0) return Failed(ReplyError::kChecksum);
  if (!asked) return ParseAnswerToAbnormal(reply, format);
  return IsEeprom(asked->id) ? ParseEeprom(*asked, reply) : ParseReadout(asked->id, reply, format);
}

Frame MakeReply(const Reply& reply) {
  Frame frame{ControlField(reply.id)};
  if (IsEeprom(reply.id)) {
    AppendEepromFields(frame, reply);
  } else {
    AppendDataFields(frame, reply);
  }
  frame.Append(Crc(frame));
  return frame;
}

std::optional<RequestFields> ParseRequest(Bytes request) {
  if (request.empty()) return std::nullopt;
  const std::optional<DataId> id = ParseControlField(request[0]);
  if (!id || request.size() != RequestSize(*id)) return std::nullopt;
  RequestFields fields;
  fields.id = *id;
  if (!IsEeprom(*id)) return fields;
  if (request[1] >= kEepromCells || Crc(request) != 0) return std::nullopt;
  fields.address = request[1];
  if (*id == DataId::kEepromWrite) fields.data = request[2];
  return fields;
}

}  // namespace axlecast::tformat
