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
  bool echo = false;  // the adapter receives its own transmission
};

// The result of one exchange.
struct Answer {
  DataId asked{};                  // the ID of the request
  std::optional<ErrorKind> error;  // nothing: the reply is what was asked for
  Reply reply;                // its fields; with an error only alarms (kAbnormalReply) or ENID (kWrongIdentity)
  bool line_unclear = false;  // bytes may still be on their way: silence before the next request
  bool not_taken = false;     // the encoder reports that it did not execute the request

  [[nodiscard]] bool ok() const { return !error; }
};

// Returns the result of an exchange. It depends only on the event (kReply or kTimeout).
[[nodiscard]] Answer Interpret(const Event& event, const Expectation& expected);

// Returns the interval that contains the time at which the encoder latched its position. It latches between the last bit
// of the request and the first bit of its reply; the exact time is not documented. `character`: the time of one byte on
// the wire; 0 for a simulated wire, which may be faster than a real one.
[[nodiscard]] Interval SamplingInstant(const Event& event, MonoNs character);

// Exchanges, with the rule for the end of their replies and the bytes that distinguish the replies: the control field,
// and the address of an EEPROM cell. An encoder that misread the request answers with the 11 bytes of ID 3.
[[nodiscard]] Exchange Ask(DataId id, MonoNs timeout);
[[nodiscard]] Exchange AskCell(std::uint8_t address, MonoNs timeout);
[[nodiscard]] Exchange WriteCell(std::uint8_t address, std::uint8_t data, MonoNs timeout);

// Returns the ID of a request of an event.
[[nodiscard]] std::optional<DataId> RequestId(Bytes request);

// Returns the time at which the exchange ended.
[[nodiscard]] MonoNs EndOf(const Event& event);

}  // namespace axlecast::tformat
