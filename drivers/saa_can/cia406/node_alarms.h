#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/device/device.h"
#include "drivers/saa_can/cia406/alarms.h"
#include "drivers/saa_can/cia406/node_facts.h"

namespace axlecast::saa_can::cia406 {

// What the encoder itself says is wrong: alarms (6503h), warnings (6505h), emergency messages. Told to the outside
// when it changes.
class NodeAlarms {
 public:
  explicit NodeAlarms(DeviceOutput& output) : output_(output) {}

  // Which of the manufacturer's bits exist, and how all bits stand.
  void Begin(const NodeFacts& facts, MonoNs now);
  void OnAlarms(std::uint32_t bits, MonoNs now);
  void OnWarnings(std::uint32_t bits, MonoNs now);
  void OnEmergency(const Emergency& emergency, MonoNs now);
  // The node has started anew: what it reported before is over (CiA 301 7.2.7.1).
  void OnBootUp(MonoNs now);

  [[nodiscard]] bool position_error() const { return (alarms_ & kPositionError) != 0; }
  [[nodiscard]] bool warning() const { return warnings_ != 0; }
  // Alarms in the lower half, warnings in the upper.
  [[nodiscard]] std::int32_t status() const {
    return static_cast<std::int32_t>(alarms_ | std::uint32_t{warnings_} << 16);
  }
  [[nodiscard]] const std::optional<Emergency>& last_emergency() const { return last_; }

 private:
  static constexpr std::size_t kMaxCodes = 8;

  void Report(std::span<const DiagnosticAlarm> table, std::uint16_t before, std::uint16_t now_set, MonoNs now);
  // Of the codes that are up, those without a bit left in the error register are over.
  void EndEmergencies(std::uint8_t error_register, MonoNs now);

  DeviceOutput& output_;
  std::uint16_t alarm_mask_ = 0xFFFF;
  std::uint16_t warning_mask_ = 0xFFFF;
  std::uint16_t alarms_ = 0;
  std::uint16_t warnings_ = 0;
  std::array<std::uint16_t, kMaxCodes> codes_{};  // of emergencies that are up
  std::size_t count_ = 0;
  bool more_ = false;
  std::optional<Emergency> last_;
};

}  // namespace axlecast::saa_can::cia406
