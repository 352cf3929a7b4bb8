#pragma once

#include <optional>

#include "core/device/step.h"
#include "drivers/saa_modbus/codec.h"

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

}  // namespace axlecast::saa_modbus
