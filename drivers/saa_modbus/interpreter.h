#pragma once

#include <cstdint>
#include <optional>

#include "core/device/device.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// Where the encoder is reached: at the start as configured, then as set_baud and set_address changed it.
struct Connection {
  std::uint8_t address = kMinAddress;
  std::int64_t baud = 0;       // of the encoder
  std::int64_t port_baud = 0;  // of our port

  friend bool operator==(const Connection&, const Connection&) = default;
};

// Reports samples, errors by kind, writes of the encoder's memory, and jumps of its position because of a setting. All
// of it depends on the events alone, so a recorded sequence gives the same results.
class Interpreter {
 public:
  // Changes `connection` when the encoder answers at the address that it was given.
  // `wire` has no baud where the line is simulated.
  Interpreter(const SaaModbusSettings& settings, const LineFormat& wire, Connection& connection,
              DeviceOutput& output)
      : settings_(settings), wire_(wire), connection_(connection), output_(output) {}

  // An exchange is over: kReply or kTimeout.
  Answer OnExchange(const Event& event) {
    Answer answer = Interpret(event, settings_.bits);
    if (answer.asked.writes()) OnWrite(answer.asked);
    const bool own = answer.asked.address == connection_.address;
    if (answer.ok()) {
      silent_in_a_row_ = 0;
      if (answer.asked.function == kReadPosition) OnPosition(answer, event);
      return answer;
    }
    // A search at another address expects silence: a timeout there is not an error.
    if (own || answer.error != ErrorKind::kTimeout) output_.OnError(*answer.error, {event.sent.first, event.End()});
    if (!own || answer.asked.function != kReadPosition) return answer;
    const bool silent = answer.unanswered && answer.error != ErrorKind::kException;
    silent_in_a_row_ = silent ? silent_in_a_row_ + 1 : 0;
    if (silent_in_a_row_ >= kGone) answering_ = false;
    return answer;
  }
  // The link was lost during this request; empty: during none.
  void OnLinkLost(Bytes request) {
    const std::optional<Request> asked = ParseRequest(request);
    if (asked && asked->writes()) OnWrite(*asked);
    answering_ = false;
    silent_in_a_row_ = 0;
  }

  // Returns whether good replies come: the last exchanges were not all silent.
  [[nodiscard]] bool answering() const { return answering_; }

 private:
  // The request may have been executed, whatever the reply was.
  void OnWrite(const Request& asked) {
    output_.OnNonVolatileWrite();
    if (asked.function == kSetAddress) new_address_ = asked.new_address;
    if (!asked.moves_datum() || datum_changing_) return;
    datum_changing_ = true;
    output_.OnDatumChanging(true);
  }
  void OnPosition(const Answer& answer, const Event& event) {
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
    sample.at = event.ActedWithin(event.bytes.size(), present.ShortestCharacter());
    sample.counts = answer.reply.counts;
    output_.OnSample(sample);
  }

  // The number of consecutive exchanges without a reply after which the encoder counts as gone.
  static constexpr int kGone = 2;

  const SaaModbusSettings& settings_;
  const LineFormat wire_;
  Connection& connection_;
  DeviceOutput& output_;
  bool answering_ = false;
  int silent_in_a_row_ = 0;
  std::optional<std::uint8_t> new_address_;  // was commanded; a reading from there confirms it
  bool datum_changing_ = false;
};

}  // namespace axlecast::saa_modbus
