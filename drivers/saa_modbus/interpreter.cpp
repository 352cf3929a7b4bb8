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

Answer Interpreter::OnExchange(const Event& event) {
  Answer answer = Interpret(event, settings_.bits);
  if (answer.asked.writes()) OnWrite(answer.asked);
  const bool own = answer.asked.address == connection_.address;
  if (answer.ok()) {
    silent_in_a_row_ = 0;
    if (answer.asked.function == kReadPosition) OnPosition(answer, event);
    return answer;
  }
  // A search at another address expects silence: a timeout there is not an error.
  if (own || answer.error != ErrorKind::kTimeout) output_.OnError(*answer.error, {event.sent.first, EndOf(event)});
  if (!own || answer.asked.function != kReadPosition) return answer;
  const bool silent = answer.unanswered && answer.error != ErrorKind::kException;
  silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
  if (silent_in_a_row_ >= kGone) answering_ = false;
  return answer;
}

void Interpreter::OnLinkLost(Bytes request) {
  const std::optional<Request> asked = ParseRequest(request);
  if (asked && asked->writes()) OnWrite(*asked);
  answering_ = false;
  silent_in_a_row_ = 0;
}

// The request may have been executed, whatever the reply was.
void Interpreter::OnWrite(const Request& asked) {
  output_.OnNonVolatileWrite();
  if (asked.function == kSetAddress) new_address_ = asked.new_address;
  if (!asked.moves_datum() || datum_changing_) return;
  datum_changing_ = true;
  output_.OnDatumChanging(true);
}

void Interpreter::OnPosition(const Answer& answer, const Event& event) {
  if (new_address_ && answer.asked.address == *new_address_) connection_.address = *new_address_;
  if (answer.asked.address != connection_.address) return;
  new_address_.reset();
  answering_ = true;
  if (datum_changing_) {
    datum_changing_ = false;
    output_.OnDatumChanging(false);
    output_.OnJump();
  }
  Sample sample;
  LineFormat present = wire_;
  if (wire_.baud > 0) present.baud = connection_.port_baud;
  sample.at = SamplingInstant(event, present.ShortestCharacter());
  sample.counts = answer.reply.counts;
  output_.OnSample(sample);
}

}  // namespace axlecast::saa_modbus
