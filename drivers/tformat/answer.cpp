#include "drivers/tformat/answer.h"

#include <algorithm>
#include <bit>

#include "drivers/tformat/reset_procedure.h"

namespace axlecast::tformat {
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
  switch (id) {
    case DataId::kSingleTurn:
      return &LengthOfReply<DataId::kSingleTurn>;
    case DataId::kMultiTurn:
      return &LengthOfReply<DataId::kMultiTurn>;
    case DataId::kEncoderId:
      return &LengthOfReply<DataId::kEncoderId>;
    case DataId::kEepromWrite:
      return &LengthOfReply<DataId::kEepromWrite>;
    case DataId::kEepromRead:
      return &LengthOfReply<DataId::kEepromRead>;
    case DataId::kAll:
      return &FixedLength<kLongestReply>;
    default:
      return &LengthOfReply<DataId::kZeroSingleTurn>;  // all resets answer alike
  }
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
  switch (error) {
    case ReplyError::kShort:
      return ErrorKind::kShort;
    case ReplyError::kLong:
      return echo ? ErrorKind::kWrongEcho : ErrorKind::kUnexpectedBytes;
    case ReplyError::kChecksum:
      return ErrorKind::kChecksum;
    case ReplyError::kWrongEcho:
      return ErrorKind::kWrongEcho;
    case ReplyError::kCommunicationAlarm:
      return ErrorKind::kCommunicationAlarm;
    case ReplyError::kAbnormalReply:
      return ErrorKind::kAbnormalReply;
    default:
      return ErrorKind::kRange;
  }
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

Interval SamplingInstant(const Event& event, MonoNs character) {
  const auto bytes = [&](std::size_t count) { return static_cast<MonoNs>(count) * character; };
  const MonoNs earliest = event.sent.first + bytes(event.request.size());
  // The first read returned at least one byte, the last read all of them.
  const MonoNs latest = std::min(event.received.first - bytes(1), event.received.last - bytes(event.bytes.size()));
  return {earliest, std::max(earliest, latest)};
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

MonoNs EndOf(const Event& event) { return std::max(event.sent.last, event.received.last); }

}  // namespace axlecast::tformat
