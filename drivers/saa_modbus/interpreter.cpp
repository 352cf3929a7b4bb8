#include "drivers/saa_modbus/interpreter.h"

namespace axlecast::saa_modbus {
namespace {

// The encoder's own reply, however damaged, is not on its way any more. An exception does not contain to which
// request it belongs.
bool HasCome(const Answer& answer, const Event& event) {
  if (answer.error == ErrorKind::kRange) return true;
  return answer.error == ErrorKind::kChecksum && event.kind == Event::Kind::kReply &&
         BeginsReplyTo(answer.asked, event.bytes);
}

}  // namespace

Answer Interpret(const Event& event, int bits) {
  Answer answer;
  answer.asked = ParseRequest(event.request).value_or(Request{});
  if (event.bytes.empty()) {
    answer.error = ErrorKind::kTimeout;
  } else {
    answer.reply = Check(answer.asked, event.bytes, bits);
    answer.error = answer.reply.error;
    if (!answer.error && event.kind == Event::Kind::kTimeout) answer.error = ErrorKind::kShort;
  }
  answer.unanswered = answer.error && !HasCome(answer, event);
  return answer;
}

Interval SamplingInstant(const Event& event, MonoNs character) {
  const auto characters = [&](std::size_t count) { return static_cast<MonoNs>(count) * character; };
  const MonoNs earliest = event.sent.first + characters(event.request.size());
  // The first read returned at least one character, the last read all of them.
  const MonoNs latest =
      std::min(event.received.first - characters(1), event.received.last - characters(event.bytes.size()));
  return {earliest, std::max(earliest, latest)};
}

MonoNs EndOf(const Event& event) { return std::max(event.sent.last, event.received.last); }

}  // namespace axlecast::saa_modbus
