#pragma once

#include <cstdint>
#include <optional>

#include "core/device/device.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// What came of one exchange.
struct Answer {
  Request asked;
  std::optional<ErrorKind> error;  // nothing: the reply is what was asked for
  Reply reply;
  bool unanswered = false;  // the reply has not come: it may still come, later

  [[nodiscard]] bool ok() const { return !error; }
};

// The outcome of an exchange, a function of the event (kReply or kTimeout) alone.
[[nodiscard]] Answer Interpret(const Event& event, int bits);

// The interval that holds the instant of the position. The encoder takes it after the last character of the request
// and before the first of its reply; where in between is not documented. `character`: time of one on the wire (0
// where the wire is simulated and may be faster than a real one).
[[nodiscard]] Interval SamplingInstant(const Event& event, MonoNs character);

// When the exchange was over.
[[nodiscard]] MonoNs EndOf(const Event& event);

// Where the encoder is reached. It begins as the file says and follows what set_baud and set_address do.
struct Connection {
  std::uint8_t address = kMinAddress;
  std::int64_t baud = 0;       // of the encoder
  std::int64_t port_baud = 0;  // of our port

  friend bool operator==(const Connection&, const Connection&) = default;
};

// What the encoder says, towards the outside: samples, errors by kind, writes of its memory, and where its position
// jumps because of a setting. All of it follows from the events alone, so a recorded sequence gives the same again.
class Interpreter {
 public:
  // Follows the encoder to the address that it was given: `connection` is changed then.
  // `wire` has no baud where the line is simulated.
  Interpreter(const SaaModbusSettings& settings, const LineFormat& wire, Connection& connection,
              DeviceOutput& output)
      : settings_(settings), wire_(wire), connection_(connection), output_(output) {}

  // An exchange is over: kReply or kTimeout.
  Answer OnExchange(const Event& event);
  // The link went while this request was under way.
  void OnLost(Bytes request);
  void OnLinkDown();

  // Good replies come: the last exchanges were not all silent.
  [[nodiscard]] bool answering() const { return answering_; }

 private:
  void OnWrite(const Request& asked);
  void OnPosition(const Answer& answer, const Event& event);

  // Exchanges in a row without an own reply, after which the encoder counts as gone.
  static constexpr int kGone = 2;

  const SaaModbusSettings& settings_;
  const LineFormat wire_;
  Connection& connection_;
  DeviceOutput& output_;
  bool answering_ = false;
  int silent_in_a_row_ = 0;
  std::optional<std::uint8_t> new_address_;  // was ordered; a reading from there shows that it was taken on
  bool datum_changing_ = false;
};

}  // namespace axlecast::saa_modbus
