#pragma once

#include <optional>
#include <variant>

#include "core/base/inline_bytes.h"
#include "core/device/operation.h"
#include "drivers/saa_modbus/answer.h"

namespace axlecast::saa_modbus {

// Where the encoder is reached. It begins as the file says and follows what set_baud and set_address do.
struct Connection {
  std::uint8_t address = kMinAddress;
  std::int64_t baud = 0;       // of the encoder
  std::int64_t port_baud = 0;  // of our port

  friend bool operator==(const Connection&, const Connection&) = default;
};

// What a procedure wants next.
struct WaitUntil {
  MonoNs until = 0;
};
struct ReadAt {  // the position; the device decides how many registers are asked for
  std::uint8_t address = 0;
};
struct Send {
  Frame request;
};
struct PortBaud {
  std::int64_t baud = 0;
};
using Want = std::variant<WaitUntil, ReadAt, Send, PortBaud>;

// One order being carried out, step by step. After a final outcome it is not used any more.
class Procedure {
 public:
  virtual ~Procedure() = default;

  [[nodiscard]] virtual Want Next(MonoNs now) const = 0;
  // The exchange that Next wanted is about to go on the wire. The outcome when this ends the procedure.
  virtual std::optional<Outcome> OnStarted([[maybe_unused]] Bytes request, [[maybe_unused]] MonoNs now) {
    return std::nullopt;
  }
  // The exchange is over at `end`. An outcome: progress, or the final one.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // The port goes on at the rate that Next wanted.
  virtual void OnRetuned([[maybe_unused]] MonoNs now) {}
  // The link is gone.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;

  // It may have changed something in the encoder.
  [[nodiscard]] virtual bool touched() const { return false; }
};

// Readings that may fail in a row.
inline constexpr int kTries = 3;

}  // namespace axlecast::saa_modbus
