#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_serial/codec.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {

// One command being carried out. It receives every reading, whichever request caused it.
class Procedure : public CommandProcedure {
 public:
  enum class Need : std::uint8_t {
    kNothing,
    kReading,  // a position, as soon as the bus allows
    kZero,     // the encoder cleared to zero
  };
  // Returns what it needs from the encoder now.
  [[nodiscard]] virtual Need Next(MonoNs now) const = 0;
  // Returns when it must be called again at the latest.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  virtual std::optional<Outcome> OnReading(const Reading& reading, MonoNs now) = 0;
  // Time has passed without a reading.
  virtual std::optional<Outcome> OnTime(MonoNs now) = 0;
  // The request to clear to zero is about to be sent.
  virtual void OnZeroStarted() {}
  // The request was sent. Readings sampled from `effect_from` on show its effect. Returns the progress, if any.
  virtual std::optional<Outcome> OnZeroed([[maybe_unused]] MonoNs effect_from) { return std::nullopt; }
};

inline constexpr std::string_view kZeroName = "zero";
inline constexpr std::string_view kReadPositionName = "read_position";

[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Returns the procedure for a command. Checks its arguments.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command, const SaaBus& bus,
                                                               const SaaSettings& settings,
                                                               const DeviceOutput& output, MonoNs now);

}  // namespace axlecast::saa_serial
