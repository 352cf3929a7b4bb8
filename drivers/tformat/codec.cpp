#include "drivers/tformat/codec.h"
#include "core/device/operation.h"

#include <array>
#include <axlecast/alarm_entry_t.hpp>
#include <bit>
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
  constexpr std::array kNames = {"none",           "short", "long", "checksum", "wrong_echo", "communication_alarm",
                                 "abnormal_reply", "range"};
  return kNames.at(static_cast<std::size_t>(error));
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

// ---- one exchange ----

namespace {

template <DataId kId>
std::size_t LengthOfReply(Bytes so_far) {
  if (so_far.empty()) return 0;
  if (so_far[0] == ControlField(DataId::kAll)) return kLongestReply;
  if (IsEeprom(kId)) return ReplySize(kId);
  if (so_far.size() < 2) return 0;
  return (so_far[1] & (kSfParity | kSfDelimiter)) != 0 ? kLongestReply : ReplySize(kId);
}

ReplyLength LengthRule(DataId id) {
  if (id == DataId::kAll) return &FixedLength<kLongestReply>;
  if (IsEeprom(id)) return &LengthOfReply<DataId::kEepromRead>;
  if (id == DataId::kEncoderId) return &LengthOfReply<DataId::kEncoderId>;
  return &LengthOfReply<DataId::kSingleTurn>;  // all resets and the turns are answered alike
}

// The model's always-zero bits are not looked at: what a reply answers does not depend on them.
ReplyMatch MatchReply(Bytes request, Bytes reply) {
  constexpr Format kAnyModel = {.single_turn_bits = 24, .multi_turn_bits = 24};
  switch (ParseReply(request, reply, kAnyModel).error) {
    case ReplyError::kNone:
    case ReplyError::kRange:
      return ReplyMatch::kYes;
    case ReplyError::kCommunicationAlarm:
    case ReplyError::kAbnormalReply:
      return ReplyMatch::kRefusal;
    case ReplyError::kChecksum: {
      constexpr int kInvertedAtMost = 2;
      if (reply[0] == request[0]) return ReplyMatch::kDamaged;
      const int inverted = std::popcount(static_cast<unsigned>(reply[0] ^ request[0]));
      return inverted <= kInvertedAtMost ? ReplyMatch::kNearly : ReplyMatch::kNo;
    }
    default:
      return ReplyMatch::kNo;
  }
}

// An encoder that misread the request answers with ID 3's data, so that a refusal looks like ID 3's reply.
ReplyShape ShapeOf(DataId id, std::uint8_t address = 0) {
  const auto shape = [](DataId of, std::uint8_t at) { return std::uint32_t{at} << 8U | ControlField(of); };
  return {.reply = shape(id, address),
          .refusal = shape(DataId::kAll, 0),
          .match = &MatchReply,
          // The ENID is the same whenever it is asked for.
          .interchangeable = id == DataId::kEncoderId,
          .exact = IsReset(id) || id == DataId::kEepromWrite};
}

// A reply that is too long holds bytes nobody asked for; where the adapter echoes, it holds an echo that differs
// from what was sent, because a true echo is taken off: somebody else transmitted at the same time.
ErrorKind KindOf(ReplyError error, bool echo) {
  using K = ErrorKind;
  constexpr std::array kKinds = {K::kRange,         K::kShort,     K::kUnexpectedBytes,
                                 K::kChecksum,      K::kWrongEcho, K::kCommunicationAlarm,
                                 K::kAbnormalReply, K::kRange};
  return error == ReplyError::kLong && echo ? K::kWrongEcho : kKinds.at(static_cast<std::size_t>(error));
}

// Another model's ENID explains bits that this model never sets, so it is looked at first.
std::optional<std::uint8_t> EncoderIdOf(const Answer& answer, Bytes reply) {
  constexpr std::size_t kEnidOfAll = 5;
  constexpr std::size_t kEnidOfId2 = 2;
  if (answer.reply.encoder_id) return answer.reply.encoder_id;
  if (answer.reply.error != ReplyError::kRange) return std::nullopt;
  if (answer.asked == DataId::kAll && reply.size() == kLongestReply) return reply[kEnidOfAll];
  if (answer.asked == DataId::kEncoderId) return reply[kEnidOfId2];
  return std::nullopt;
}

}  // namespace

Answer Interpret(const Event& event, const Expectation& expected) {
  Answer answer;
  answer.asked = RequestId(event.request).value_or(DataId::kAll);
  answer.line_unclear = true;
  if (event.bytes.empty()) {
    answer.error = ErrorKind::kTimeout;
    return answer;
  }
  answer.reply = ParseReply(event.request, event.bytes, expected.format);
  const ReplyError error = answer.reply.error;
  if (error != ReplyError::kNone)
    answer.error = KindOf(error, expected.echo);
  else if (event.kind == Event::Kind::kTimeout)
    answer.error = ErrorKind::kShort;
  const bool judged = error == ReplyError::kNone || error == ReplyError::kRange;
  const std::optional<std::uint8_t> encoder_id = EncoderIdOf(answer, event.bytes);
  if (judged && encoder_id && encoder_id != expected.encoder_id) {
    answer.error = ErrorKind::kWrongIdentity;
    answer.reply.encoder_id = encoder_id;
  }
  answer.not_taken = error == ReplyError::kCommunicationAlarm || error == ReplyError::kAbnormalReply;
  const bool whole = answer.ok() || answer.not_taken || answer.error == ErrorKind::kWrongIdentity;
  answer.line_unclear = !whole || event.kind == Event::Kind::kTimeout;
  return answer;
}

Exchange Ask(DataId id, MonoNs timeout) {
  Exchange exchange{.request = Request(id), .reply_length = LengthRule(id), .timeout = timeout};
  exchange.shape = ShapeOf(id);
  return exchange;
}

Exchange AskCell(std::uint8_t address, MonoNs timeout) {
  Exchange exchange{
      .request = EepromReadRequest(address), .reply_length = LengthRule(DataId::kEepromRead), .timeout = timeout};
  exchange.shape = ShapeOf(DataId::kEepromRead, address);
  return exchange;
}

Exchange WriteCell(std::uint8_t address, std::uint8_t data, MonoNs timeout) {
  Exchange exchange{.request = EepromWriteRequest(address, data),
                    .reply_length = LengthRule(DataId::kEepromWrite),
                    .timeout = timeout};
  exchange.shape = ShapeOf(DataId::kEepromWrite, address);
  return exchange;
}

std::optional<DataId> RequestId(Bytes request) {
  return request.empty() ? std::nullopt : ParseControlField(request[0]);
}

// ---- alarms ----

namespace {

constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

constexpr DeviceAlarm Alarm(std::uint8_t bit, const char* symbol, bool latched, std::uint8_t severity,
                            const char* name, const char* action) {
  return {
      bit, symbol, latched, {0x100 + std::countr_zero(bit), alarm_entry_t::SOURCE_DEVICE, severity, name, action}};
}

constexpr std::array<DeviceAlarm, 7> kAlarms = {
    Alarm(kAlmOverSpeed, "OS", true, kError, "over_speed",
          "Turns may be wrong: reset turns and errors, then reference again"),
    Alarm(kAlmFullAbsolute, "FS", false, kWarning, "full_absolute_status",
          "Accuracy is 5 bits: slow down below 100 rpm and wait until it clears itself"),
    Alarm(kAlmCountingError, "CE", false, kCritical, "counting_error",
          "Stop the servo system at once; if it stays, turn the power off and on"),
    Alarm(kAlmCounterOverflow, "OF", true, kWarning, "counter_overflow",
          "Turns have passed 65535 and continue from 0: clear the errors"),
    Alarm(kAlmMultiTurnError, "ME", true, kError, "multi_turn_error",
          "Return to the origin position, then reset turns and errors"),
    Alarm(kAlmBatteryError, "BE", true, kError, "battery_error",
          "Check or replace the battery, then reset turns and errors"),
    Alarm(kAlmBatteryAlarm, "BA", false, kWarning, "battery_alarm",
          "Check or replace the battery; the alarm clears itself"),
};

}  // namespace

const std::array<DeviceAlarm, 7>& DeviceAlarms() { return kAlarms; }

const AlarmSpec kWrongIdentity = {0x110, alarm_entry_t::SOURCE_DRIVER, kCritical, "wrong_identity",
                                  "Another encoder is connected than configured: check cables and configuration"};
const AlarmSpec kMisreadRequest = {0x111, alarm_entry_t::SOURCE_DEVICE, kWarning, "communication_alarm",
                                   "The encoder misread a request: check cable, shield and termination"};

std::vector<AlarmSpec> Alarms() {
  std::vector<AlarmSpec> alarms = {kWrongIdentity, kMisreadRequest};
  for (const DeviceAlarm& alarm : kAlarms) alarms.push_back(alarm.spec);
  return alarms;
}

std::string AlarmText(std::uint8_t alarms) {
  std::string text = Text("0x%02X", unsigned{alarms});
  for (const DeviceAlarm& alarm : kAlarms) {
    if ((alarms & alarm.bit) != 0) text.append(" ").append(alarm.symbol);
  }
  return text;
}

}  // namespace axlecast::tformat
