#include "drivers/tsubaki_sc/answer.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {
namespace {

// Guideline 12; 5 for an error.
modbus::Reply CheckVersion(Bytes request, Bytes reply) {
  constexpr std::size_t kSize = 6;
  if (reply.size() != kSize) return modbus::Check(request, reply);
  if (!modbus::IsSealed(reply)) return {.error = ErrorKind::kChecksum};
  if (reply[0] != request[0] || reply[1] != request[1]) return {.error = ErrorKind::kWrongEcho};
  return {.data = reply.subspan(2, 2)};
}

// AI 300 knows two values.
bool InRange(const Answer& answer) {
  if (answer.block != kLoginStatus) return true;
  const std::uint16_t status = answer.reply.Register(0);
  return status == kSaysLoggedOut || status == kSaysLoggedIn;
}

// The unit acts after the last bit of the request and before the first bit of its reply.
Interval ActedAt(const Event& event, MonoNs character) {
  const auto wire = [&](std::size_t characters) { return static_cast<MonoNs>(characters) * character; };
  const MonoNs earliest = event.sent.first + wire(event.request.size());
  const MonoNs latest = std::min(event.received.first - wire(1), event.received.last - wire(event.bytes.size()));
  return {earliest, std::max(earliest, latest)};
}

}  // namespace

Answer Interpret(const Event& event, MonoNs character) {
  Answer answer;
  answer.request = event.request;
  answer.block = BlockOf(event.request);
  answer.end = std::max(event.sent.last, event.received.last);
  answer.at = ActedAt(event, character);
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

std::int32_t ReasonOf(const Answer& answer) {
  if (answer.refused()) return command_status_t::REASON_DEVICE_REFUSED;
  return command_status_t::REASON_NO_REPLY;
}

}  // namespace axlecast::tsubaki_sc
