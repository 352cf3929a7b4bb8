#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"

namespace axlecast {

// The devices on one simulated bus: strict, set in physical units, free of I/O. tools/simulate puts it on a pty.
class Simulator {
 public:
  using Transmit = std::function<void(Bytes bytes)>;  // puts bytes on the line now

  virtual ~Simulator() = default;

  // The host's bytes arrived at `now`. `transmit` may be called at once.
  virtual void OnBytes(Bytes bytes, MonoNs now, const Transmit& transmit) = 0;

  // A line beside the bus was driven low for `low` and high again, ending at `now`.
  virtual void OnPulse([[maybe_unused]] std::uint8_t line, [[maybe_unused]] MonoNs low, [[maybe_unused]] MonoNs now,
                       [[maybe_unused]] const Transmit& transmit) {}
  // The host has set its port to this rate: a device at another one hears only noise. Before the first OnBytes too.
  virtual void OnBaud([[maybe_unused]] std::int64_t baud) {}

  // Something (a delayed reply, a script step) is due at this instant; kNever when nothing is.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  virtual void OnDue(MonoNs now, const Transmit& transmit) = 0;

  // Changes a quantity of a device while it runs: physical quantities and faults by name.
  // An empty string when done, else the cause and what would be right.
  [[nodiscard]] virtual std::string Set(std::string_view device, std::string_view key, std::string_view value,
                                        MonoNs now) = 0;
  // Quantities with their present values and complaints ("addressed while it transmits"), in a stable order.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> State(std::string_view device,
                                                                               MonoNs now) const = 0;
};

}  // namespace axlecast
