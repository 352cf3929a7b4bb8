#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "core/base/result.h"
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
  // A request with a password in it or in its reply.
  [[nodiscard]] Exchange Secret(const Frame& request) const;

 private:
  [[nodiscard]] Exchange Ask(const Frame& request) const;

  std::uint8_t address_;
  MonoNs timeout_;
};

// Returns whether the request is a login: a write to AO 100-107.
[[nodiscard]] bool IsLogin(Bytes request);

// The result of one exchange. Views live as long as the event.
struct Answer {
  std::optional<ErrorKind> error;  // nothing: the reply fits the request
  std::uint8_t exception = 0;      // with ErrorKind::kException
  std::optional<Block> block;      // what the request reads
  modbus::Reply reply;             // data of a good read; of the version its two bytes
  bool unclear = false;            // a reply may still come: it must not be taken for a later one
  Interval at;                     // the unit acted within it
  MonoNs end = 0;
  Bytes request;

  [[nodiscard]] bool ok() const { return !error; }
  [[nodiscard]] bool refused() const { return error == ErrorKind::kException; }
  [[nodiscard]] bool refused_for_login() const { return refused() && exception == kLoginError; }
};

// Returns the answer of an exchange. It depends on the event (kReply or kTimeout) alone. `character` is the time of a
// character on the wire; 0: the wire is simulated and may be faster.
[[nodiscard]] Answer Interpret(const Event& event, MonoNs character);

// "timeout", "error 02 (address error)"
[[nodiscard]] std::string CauseOf(const Answer& answer);
// Returns the error of a command that ends because of an answer: the unit refused, or did not reply.
[[nodiscard]] Error ErrorOf(const Answer& answer);

// Maximum number of consecutive failures of the same request.
inline constexpr int kTries = 3;
// Counts a failed answer. Returns whether its request may be repeated: the unit did not refuse it.
[[nodiscard]] inline bool MayRepeat(const Answer& answer, int& failures) {
  return !answer.refused() && ++failures < kTries;
}

}  // namespace axlecast::tsubaki_sc
