#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/line_settings.h"

namespace axlecast {

// The devices on one simulated bus: strict, set in physical units, free of I/O. tools/simulate puts it on a pty.
class Simulator {
 public:
  using Transmit = std::function<void(Bytes bytes)>;  // puts bytes, or a CAN frame as its packet, on the line now

  virtual ~Simulator() = default;

  // Receives data from the host at `now`: one of these functions, depending on the family's link. `transmit` may be called
  // during the call.
  virtual void OnBytes([[maybe_unused]] Bytes bytes, [[maybe_unused]] MonoNs now,
                       [[maybe_unused]] const Transmit& transmit) {}
  // True when a node on the bus acknowledges the frame: one that runs at the host's bit rate.
  [[nodiscard]] virtual bool OnFrame([[maybe_unused]] const CanFrame& frame, [[maybe_unused]] MonoNs now,
                                     [[maybe_unused]] const Transmit& transmit) {
    return false;
  }
  // Fills `rx`, as long as the transfer, with what the host clocks in; its first clock edge is at `now`.
  virtual void OnTransfer([[maybe_unused]] const SpiTransfer& transfer, [[maybe_unused]] MonoNs now,
                          [[maybe_unused]] std::span<std::uint8_t> rx) {}

  // A line beside the bus was driven low for `low` and high again, ending at `now`.
  virtual void OnPulse([[maybe_unused]] std::uint8_t line, [[maybe_unused]] MonoNs low, [[maybe_unused]] MonoNs now,
                       [[maybe_unused]] const Transmit& transmit) {}
  // The host has set its port to this rate, baud or bit/s: a device with another rate receives only noise. It is also
  // called before the first data from the host.
  virtual void OnBaud([[maybe_unused]] std::int64_t baud) {}

  // Something (a delayed reply, a script step) is due at this instant; kNever when nothing is.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  virtual void OnDue(MonoNs now, const Transmit& transmit) = 0;

  // Changes a quantity of a device while it runs: physical quantities and faults by name.
  [[nodiscard]] virtual Result<> Set(std::string_view device, std::string_view key, std::string_view value,
                                     MonoNs now) = 0;
  // Quantities with their present values and complaints ("addressed while it transmits"), in a stable order.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> State(std::string_view device,
                                                                               MonoNs now) const = 0;
};

}  // namespace axlecast
