#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/device/reading.h"
#include "core/device/step.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// The exchanges with one unit.
class Requests {
 public:
  Requests(std::uint8_t address, MonoNs timeout) : address_(address), timeout_(timeout) {}

  [[nodiscard]] std::uint8_t address() const { return address_; }
  [[nodiscard]] Exchange Read(const Block& block) const;
  [[nodiscard]] Exchange SetCoil(std::uint16_t coil) const;  // to ON; nothing here ever writes OFF
  // One value by function 06, several by function 16.
  [[nodiscard]] Exchange Write(std::uint16_t first, std::span<const std::uint16_t> values) const;
  // A request that holds a password, or is answered with one.
  [[nodiscard]] Exchange Secret(const Frame& request) const;

 private:
  [[nodiscard]] Exchange Ask(const Frame& request) const;

  std::uint8_t address_;
  MonoNs timeout_;
};

// The request is a login: a write to AO 100-107.
[[nodiscard]] bool IsLogin(Bytes request);

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
// Returns the REASON_* of a command that ends because of it: the unit refused, or did not reply.
[[nodiscard]] std::int32_t ReasonOf(const Answer& answer);

}  // namespace axlecast::tsubaki_sc
