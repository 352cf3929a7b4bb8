#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/device/reading.h"
#include "core/device/step.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// What came of one exchange. Views live as long as the event.
struct Answer {
  std::optional<ErrorKind> error;  // nothing: the reply is what was asked for
  std::uint8_t exception = 0;      // with ErrorKind::kException
  std::optional<Block> block;      // what the request reads
  modbus::Reply reply;             // data of a good read; of the version its two bytes
  bool unclear = false;            // a reply may still be on its way: it must not be taken for a later one
  Interval at;                     // holds the instant at which the unit acted
  MonoNs end = 0;
  Bytes request;

  [[nodiscard]] bool ok() const { return !error; }
  [[nodiscard]] bool refused() const { return error == ErrorKind::kException; }
  [[nodiscard]] bool refused_for_login() const { return refused() && exception == kLoginError; }
};

// The outcome of an exchange, a function of the event (kReply or kTimeout) alone. `character` is the time of a
// character on the wire, 0 where the wire is simulated and may be faster.
[[nodiscard]] Answer Interpret(const Event& event, MonoNs character);

// "timeout", "error 02 (address error)"
[[nodiscard]] std::string CauseOf(const Answer& answer);
// The REASON_* of an order that ends because of it: the unit refused, or did not reply.
[[nodiscard]] std::int32_t ReasonOf(const Answer& answer);

}  // namespace axlecast::tsubaki_sc
