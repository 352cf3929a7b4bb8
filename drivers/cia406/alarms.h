#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/device/device.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/settings.h"

namespace axlecast::cia406 {

// Bits of 6503h (alarms) or of 6505h (warnings) that are published as one alarm.
struct DiagnosticAlarm {
  std::uint16_t bits;
  AlarmSpec spec;
};

// Alarms: the position may be wrong. Bit 0 is position error (CiA 406, object 6503h; TR-Electronic CEH 110 manual
// 10.12.4; Pepperl+Fuchs absolute rotary encoder manual 2017-04, 9.5.69), bit 1 commissioning diagnostics (also 9.5.69).
// Bits 12 to 15 are the manufacturer's.
[[nodiscard]] std::span<const DiagnosticAlarm> Alarms();
inline constexpr std::uint16_t kPositionError = 0x0001;
// Warnings: a tolerance is exceeded, the position is right (object 6505h; the same manual, 9.5.71 with its table).
[[nodiscard]] std::span<const DiagnosticAlarm> Warnings();

// Returns the alarm of an EMCY: code 0x10000 + the error code, name by its class.
[[nodiscard]] AlarmSpec EmergencyAlarm(std::uint16_t error_code);

inline constexpr std::uint8_t kOfDevice = alarm_entry_t::SOURCE_DEVICE;
inline constexpr std::uint8_t kOfDriver = alarm_entry_t::SOURCE_DRIVER;
inline constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
inline constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
inline constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

inline constexpr AlarmSpec kWrongEncoder = {0x140, kOfDriver, kCritical, "wrong_encoder",
                                            "Not the encoder or setting of the file: DEVICE shows what differs"};
inline constexpr AlarmSpec kHeartbeatLost = {0x141, kOfDriver, kError, "heartbeat_lost",
                                             "No heartbeat within heartbeat_ms: check supply, cable, object 1017h"};
inline constexpr AlarmSpec kNotOperational = {
    0x142, kOfDriver, kError, "not_operational",
    "The node sends no positions: nmt_start, or another master stopped it"};
inline constexpr AlarmSpec kSecondSync = {0x143, kOfDriver, kWarning, "second_sync_producer",
                                          "Another node sends SYNC too: only one may; transmission: as_configured"};
inline constexpr AlarmSpec kPeriodDiffers = {
    0x144, kOfDriver, kWarning, "period_differs",
    "The encoder's event timer (1800h sub 5) is not period_ms: change one"};
inline constexpr AlarmSpec kMoreEmergencies = {0x145, kOfDevice, kError, "more_emergencies",
                                               "The encoder reports more error codes than are shown: read_state"};

// The faults that the encoder reports: alarms (6503h), warnings (6505h), emergency messages. Changes are published.
class NodeAlarms {
 public:
  explicit NodeAlarms(DeviceOutput& output) : output_(output) { codes_.reserve(kMaxCodes); }

  // Takes from the facts which of the manufacturer's bits exist, and the state of all bits.
  void Begin(const NodeFacts& facts, MonoNs now);
  void OnAlarms(std::uint32_t bits, MonoNs now);
  void OnWarnings(std::uint32_t bits, MonoNs now);
  void OnEmergency(const Emergency& emergency, MonoNs now);
  // The node has restarted: what it reported before is over (CiA 301 7.2.7.1).
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
  // Ends the emergencies whose bit is not set in the error register.
  void EndEmergencies(std::uint8_t error_register, MonoNs now);

  DeviceOutput& output_;
  std::uint16_t alarm_mask_ = 0xFFFF;
  std::uint16_t warning_mask_ = 0xFFFF;
  std::uint16_t alarms_ = 0;
  std::uint16_t warnings_ = 0;
  std::vector<std::uint16_t> codes_;  // of the emergencies that have not ended, at most kMaxCodes
  bool more_ = false;
  std::optional<Emergency> last_;
};

}  // namespace axlecast::cia406
