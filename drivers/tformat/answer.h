#pragma once

#include <cstdint>
#include <optional>

#include "core/device/reading.h"
#include "core/device/step.h"
#include "drivers/tformat/codec.h"

namespace axlecast::tformat {

// What a reply is checked against.
struct Expectation {
  Format format;
  std::uint8_t encoder_id = 0;
  bool echo = false;  // the adapter hears its own transmission
};

// What came of one exchange.
struct Answer {
  DataId asked{};                  // the ID of the request
  std::optional<ErrorKind> error;  // nothing: the reply is what was asked for
  Reply reply;                // its fields; with an error only alarms (kAbnormalReply) or ENID (kWrongIdentity)
  bool line_unclear = false;  // bytes may still be on their way: silence before the next request
  bool not_taken = false;     // the encoder says that it did not act on the request

  [[nodiscard]] bool ok() const { return !error; }
};

// The outcome of an exchange, a function of the event (kReply or kTimeout) alone.
[[nodiscard]] Answer Interpret(const Event& event, const Expectation& expected);

// The interval that holds the instant at which the encoder latched its position. It latches after the last bit of
// the request and before the first bit of its reply, and where in between is not documented. Request and reply take
// their time on the wire: `character` for each byte (0 where the wire is simulated and may be faster than a real
// one).
[[nodiscard]] Interval SamplingInstant(const Event& event, MonoNs character);

// Exchanges, with the rule by which their replies end and with what tells those apart: the control field; of the EEPROM
// the address too. An encoder that misread the request answers with ID 3's 11
// bytes.
[[nodiscard]] Exchange Ask(DataId id, MonoNs timeout);
[[nodiscard]] Exchange AskCell(std::uint8_t address, MonoNs timeout);
[[nodiscard]] Exchange WriteCell(std::uint8_t address, std::uint8_t data, MonoNs timeout);

// The ID of a request as it stands in an event.
[[nodiscard]] std::optional<DataId> RequestId(Bytes request);

// When the exchange was over.
[[nodiscard]] MonoNs EndOf(const Event& event);

}  // namespace axlecast::tformat
