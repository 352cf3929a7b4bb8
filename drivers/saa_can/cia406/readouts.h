#pragma once

#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/saa_can/cia406/interpreter.h"
#include "drivers/saa_can/cia406/readout.h"
#include "drivers/saa_can/cia406/settings.h"

namespace axlecast::saa_can::cia406 {

// 6004h; with a `target` also whether that is where a preset to it would have left the encoder.
class PositionReadout final : public Readout {
 public:
  PositionReadout(std::optional<std::uint32_t> target, const Cia406Settings& settings, const DeviceOutput& output,
                  MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;

  const std::optional<std::uint32_t> target_;
  const Cia406Settings& settings_;
  const DeviceOutput& output_;
};

// Device type, and who made it: 1000h, 1018h.
class IdentityReadout final : public Readout {
 public:
  explicit IdentityReadout(MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;
};

// How it is: NMT state, error register, operating status, alarms, warnings, the last emergency message.
class StateReadout final : public Readout {
 public:
  StateReadout(const Interpreter& interpreter, MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;

  const Interpreter& interpreter_;
};

// "turns 3, single-turn 4096 (180.0000 deg)"
[[nodiscard]] std::string PositionText(std::uint32_t position, const Cia406Settings& settings);
// Whether an encoder at rest that was set to `target` may read `position`.
[[nodiscard]] bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings);

}  // namespace axlecast::saa_can::cia406
