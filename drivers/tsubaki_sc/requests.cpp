#include "drivers/tsubaki_sc/requests.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {
namespace {

// Guideline 12: address, 11, version high and low, CRC: there is no byte count.
std::size_t VersionLength(Bytes so_far) {
  constexpr std::size_t kVersionReply = 6;
  constexpr std::size_t kExceptionReply = 5;
  if (so_far.size() < 2) return 0;
  return (so_far[1] & 0x80) != 0 ? kExceptionReply : kVersionReply;
}

// A reply to Report Slave ID has no byte count: the standard check does not know it.
ReplyMatch MatchVersion(Bytes request, Bytes reply) {
  constexpr std::size_t kSize = 6;
  if (reply.size() != kSize) return modbus::MatchReply(request, reply);
  const bool own = reply[0] == request[0] && reply[1] == request[1];
  if (!own) return ReplyMatch::kNo;
  return modbus::IsSealed(reply) ? ReplyMatch::kYes : ReplyMatch::kDamaged;
}

// Guideline 12; 5 for an error.
modbus::Reply CheckVersion(Bytes request, Bytes reply) {
  constexpr std::size_t kSize = 6;
  if (reply.size() != kSize) return modbus::Check(request, reply);
  if (!modbus::IsSealed(reply)) return {.error = ErrorKind::kChecksum};
  if (reply[0] != request[0] || reply[1] != request[1]) return {.error = ErrorKind::kWrongEcho};
  return {.data = reply.subspan(2, 2)};
}

// AI 300 has two values.
bool InRange(const Answer& answer) {
  if (answer.block != kLoginStatus) return true;
  const std::uint16_t status = answer.reply.Register(0);
  return status == kSaysLoggedOut || status == kSaysLoggedIn;
}

}  // namespace

Exchange Requests::Read(const Block& block) const {
  if (block == kVersion) {
    const auto function = static_cast<std::uint8_t>(modbus::Function::kReportServerId);
    Exchange exchange = Ask(modbus::Sealed({address_, function}));
    exchange.reply_length = &VersionLength;
    exchange.shape.match = &MatchVersion;
    return exchange;
  }
  Exchange exchange = Ask(modbus::Read(address_, block.read, block.first, block.count));
  // A late reply to this request is as good as a new one, so that it can be the fence.
  exchange.shape.interchangeable = block == kMains;
  return exchange;
}

// A stop is never held back. Its effect is read afterwards.
Exchange Requests::SetCoil(std::uint16_t coil) const {
  Exchange exchange = Ask(modbus::WriteCoil(address_, coil, true));
  if (coil == kStopCoilAddress) {
    exchange.shape.interchangeable = true;
    exchange.shape.exact = false;
  }
  return exchange;
}

Exchange Requests::Write(std::uint16_t first, std::span<const std::uint16_t> values) const {
  return Ask(values.size() == 1 ? modbus::WriteRegister(address_, first, values[0])
                                : modbus::WriteRegisters(address_, first, values));
}

Exchange Requests::Secret(const Frame& request) const {
  Exchange exchange = Ask(request);
  exchange.secret = true;
  return exchange;
}

Exchange Requests::Ask(const Frame& request) const {
  Exchange exchange{.request = request, .reply_length = &modbus::ReplyLength, .timeout = timeout_};
  exchange.shape = modbus::ShapeOf(request);
  return exchange;
}

bool IsLogin(Bytes request) {
  constexpr std::size_t kShortest = 6;
  return request.size() >= kShortest &&
         request[1] == static_cast<std::uint8_t>(modbus::Function::kWriteRegisters) &&
         ((request[2] << 8) | request[3]) == kLoginBlock.first;
}

Answer Interpret(const Event& event, MonoNs character) {
  Answer answer;
  answer.request = event.request;
  answer.block = BlockOf(event.request);
  answer.end = event.End();
  answer.at = event.ActedWithin(event.bytes.size(), character);
  answer.unclear = true;
  if (event.bytes.empty()) {
    answer.error = ErrorKind::kTimeout;
    return answer;
  }
  answer.reply = answer.block == kVersion ? CheckVersion(event.request, event.bytes)
                                          : modbus::Check(event.request, event.bytes);
  answer.error = answer.reply.error;
  answer.exception = answer.reply.exception;
  if (event.kind == Event::Kind::kTimeout && !answer.error) answer.error = ErrorKind::kShort;
  answer.unclear = event.kind == Event::Kind::kTimeout || !(answer.ok() || answer.refused());
  if (answer.ok() && !InRange(answer)) answer.error = ErrorKind::kRange;
  return answer;
}

std::string CauseOf(const Answer& answer) {
  if (answer.refused()) return Text("error %02X (%s)", unsigned{answer.exception}, ExceptionName(answer.exception));
  return answer.error ? ErrorName(*answer.error) : "no error";
}

Error ErrorOf(const Answer& answer) {
  std::int32_t reason = command_status_t::REASON_NO_REPLY;
  if (answer.refused()) reason = command_status_t::REASON_DEVICE_REFUSED;
  return {CauseOf(answer), reason};
}

}  // namespace axlecast::tsubaki_sc
