#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/device/device.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/settings.h"

namespace axlecast::cia406 {

// Bits of 6503h (alarms) or of 6505h (warnings) that are one alarm towards the outside.
struct DiagnosticAlarm {
  std::uint16_t bits;
  AlarmSpec spec;
};

// An alarm: the position may be wrong. Bit 0 is position error (CiA 406, object 6503h; TR-Electronic CEH 110 manual
// 10.12.4; Pepperl+Fuchs absolute rotary encoder manual 2017-04, 9.5.69), bit 1 commissioning diagnostics (the same
// 9.5.69), bits 12 to 15 the manufacturer's.
[[nodiscard]] std::span<const DiagnosticAlarm> Alarms();
inline constexpr std::uint16_t kPositionError = 0x0001;
// A warning: a tolerance is exceeded, the position is right (object 6505h; the same manual, 9.5.71 with its table).
[[nodiscard]] std::span<const DiagnosticAlarm> Warnings();
// Bits that mean the same in every encoder. The manufacturer's are heeded where 6504h or 6506h says that they
// exist.
inline constexpr std::uint16_t kStandardBits = 0x0FFF;

// Of an EMCY: code 0x10000 + the error code, name by its class.
[[nodiscard]] AlarmSpec EmergencyAlarm(std::uint16_t error_code);
// The bit of the error register that speaks of this error code's class; 0 where the standard names none.
[[nodiscard]] std::uint8_t RegisterBitOf(std::uint16_t error_code);

extern const AlarmSpec kWrongEncoder;
extern const AlarmSpec kHeartbeatLost;
extern const AlarmSpec kNotOperational;
extern const AlarmSpec kSecondSync;
extern const AlarmSpec kPeriodDiffers;
extern const AlarmSpec kMoreEmergencies;

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

}  // namespace axlecast::cia406
