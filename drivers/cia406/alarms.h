#pragma once

#include <algorithm>
#include <array>
#include <axlecast/alarm_entry_t.hpp>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/device/device.h"
#include "drivers/cia406/node_facts.h"
#include "drivers/cia406/settings.h"

namespace axlecast::cia406 {

inline constexpr std::uint8_t kOfDevice = alarm_entry_t::SOURCE_DEVICE;
inline constexpr std::uint8_t kOfDriver = alarm_entry_t::SOURCE_DRIVER;
inline constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
inline constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
inline constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

// Bits of 6503h (alarms) or of 6505h (warnings) that are published as one alarm.
struct DiagnosticAlarm {
  std::uint16_t bits;
  AlarmSpec spec;
};

inline constexpr const char* kSeeManual = "Set by the encoder: its manual describes the bit";

// Alarms: the position may be wrong. Bit 0 is position error (CiA 406, object 6503h; TR-Electronic CEH 110 manual
// 10.12.4; Pepperl+Fuchs absolute rotary encoder manual 2017-04, 9.5.69), bit 1 commissioning diagnostics (also 9.5.69).
// Bits 12 to 15 are the manufacturer's.
inline constexpr std::array<DiagnosticAlarm, 7> kAlarmTable = {{
    {0x0001,
     {0x120, kOfDevice, kCritical, "position_error",
      "The position may be wrong: stop the axis, check the encoder"}},
    {0x0002,
     {0x121, kOfDevice, kError, "commissioning_error", "Commissioning diagnostics failed: check the encoder"}},
    {0x0FFC,
     {0x122, kOfDevice, kError, "reserved_alarm", "A bit of 6503h that the profile reserves: read_state shows it"}},
    {0x1000, {0x12C, kOfDevice, kError, "manufacturer_alarm_12", kSeeManual}},
    {0x2000, {0x12D, kOfDevice, kError, "manufacturer_alarm_13", kSeeManual}},
    {0x4000, {0x12E, kOfDevice, kError, "manufacturer_alarm_14", kSeeManual}},
    {0x8000, {0x12F, kOfDevice, kError, "manufacturer_alarm_15", kSeeManual}},
}};
inline constexpr std::uint16_t kPositionError = 0x0001;
// Warnings: a tolerance is exceeded, the position is right (object 6505h; the same manual, 9.5.71 with its table).
inline constexpr std::array<DiagnosticAlarm, 8> kWarningTable = {{
    {0x0001,
     {0x130, kOfDevice, kWarning, "frequency_exceeded",
      "The shaft turns faster than the encoder allows: slow down"}},
    {0x0002,
     {0x131, kOfDevice, kWarning, "light_control_reserve", "The light source is near its end: plan to replace it"}},
    {0x0004,
     {0x132, kOfDevice, kWarning, "cpu_watchdog",
      "The encoder's processor was reset: watch it, replace it if it recurs"}},
    {0x0008,
     {0x133, kOfDevice, kWarning, "operating_time_limit",
      "The encoder has reached its operating time: plan to replace it"}},
    {0x0010, {0x134, kOfDevice, kWarning, "battery_charge", "The encoder's battery is low: replace it"}},
    {0x0020,
     {0x135, kOfDevice, kWarning, "reference_not_reached",
      "The reference point has not been passed since power-on"}},
    {0x0FC0,
     {0x136, kOfDevice, kWarning, "reserved_warning",
      "A bit of 6505h that the profile reserves: read_state shows it"}},
    {0xF000, {0x13C, kOfDevice, kWarning, "manufacturer_warning", kSeeManual}},
}};

struct ClassAlarm {
  std::uint8_t first;  // upper byte of the error code
  std::uint8_t last;
  const char* name;
  std::uint8_t register_bit;  // 0 if the standard has none
};

// Classes of CiA 301 table 26, bits of 1001h (7.5.2.2). The last entry is for all other codes.
inline constexpr std::array<ClassAlarm, 13> kClasses = {{
    {0x10, 0x1F, "emergency_generic", 0x01},
    {0x20, 0x2F, "emergency_current", 0x02},
    {0x30, 0x3F, "emergency_voltage", 0x04},
    {0x40, 0x4F, "emergency_temperature", 0x08},
    {0x50, 0x5F, "emergency_hardware", 0},
    {0x60, 0x6F, "emergency_software", 0},
    {0x70, 0x7F, "emergency_module", 0},
    {0x80, 0x80, "emergency_monitoring", 0},
    {0x81, 0x82, "emergency_communication", 0x10},
    {0x83, 0x8F, "emergency_monitoring", 0},
    {0x90, 0x9F, "emergency_external", 0},
    {0xFF, 0xFF, "emergency_device", 0},
    {0x00, 0xFF, "emergency", 0},
}};

inline const ClassAlarm& ClassOf(std::uint16_t error_code) {
  const int upper = error_code >> 8;
  return *std::find_if(kClasses.begin(), kClasses.end(),
                       [&](const ClassAlarm& known) { return upper >= known.first && upper <= known.last; });
}

// Returns the alarm of an EMCY: code 0x10000 + the error code, name by its class.
[[nodiscard]] inline AlarmSpec EmergencyAlarm(std::uint16_t error_code) {
  return {0x10000 + error_code, kOfDevice, kError, ClassOf(error_code).name,
          "The code's last four hex digits are the error code: read_state, encoder's manual"};
}

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
  void Begin(const NodeFacts& facts, MonoNs now) {
    alarm_mask_ = MaskOf(facts.Get(kSupportedAlarms));
    warning_mask_ = MaskOf(facts.Get(kSupportedWarnings));
    OnAlarms(facts.Get(kAlarms).value_or(0), now);
    OnWarnings(facts.Get(kWarnings).value_or(0), now);
  }
  void OnAlarms(std::uint32_t bits, MonoNs now) {
    const auto used = static_cast<std::uint16_t>(bits & alarm_mask_);
    Report(kAlarmTable, std::exchange(alarms_, used), used, now);
  }
  void OnWarnings(std::uint32_t bits, MonoNs now) {
    const auto used = static_cast<std::uint16_t>(bits & warning_mask_);
    Report(kWarningTable, std::exchange(warnings_, used), used, now);
  }
  void OnEmergency(const Emergency& emergency, MonoNs now) {
    last_ = emergency;
    if (emergency.IsReset()) return EndEmergencies(emergency.error_register, now);
    if (std::find(codes_.begin(), codes_.end(), emergency.code) != codes_.end()) return;
    if (codes_.size() == kMaxCodes) {
      if (!std::exchange(more_, true)) output_.OnAlarm(kMoreEmergencies, AlarmState::kLive, now);
      return;
    }
    codes_.push_back(emergency.code);
    output_.OnAlarm(EmergencyAlarm(emergency.code), AlarmState::kLive, now);
  }
  // The node has restarted: what it reported before is over (CiA 301 7.2.7.1).
  void OnBootUp(MonoNs now) {
    EndEmergencies(0, now);
    last_.reset();
  }

  [[nodiscard]] bool position_error() const { return (alarms_ & kPositionError) != 0; }
  [[nodiscard]] bool warning() const { return warnings_ != 0; }
  // Alarms in the lower half, warnings in the upper.
  [[nodiscard]] std::int32_t status() const {
    return static_cast<std::int32_t>(alarms_ | std::uint32_t{warnings_} << 16);
  }
  [[nodiscard]] const std::optional<Emergency>& last_emergency() const { return last_; }

 private:
  static constexpr std::size_t kMaxCodes = 8;
  // Bits with the same meaning in every encoder. The manufacturer's bits are used only if 6504h or 6506h shows that they exist.
  static constexpr std::uint16_t kStandardBits = 0x0FFF;

  [[nodiscard]] static std::uint16_t MaskOf(std::optional<std::uint32_t> supported) {
    return static_cast<std::uint16_t>(supported ? *supported | kStandardBits : 0xFFFFU);
  }

  void Report(std::span<const DiagnosticAlarm> table, std::uint16_t before, std::uint16_t now_set, MonoNs now) {
    for (const DiagnosticAlarm& alarm : table) {
      const bool was = (before & alarm.bits) != 0;
      const bool is = (now_set & alarm.bits) != 0;
      if (was != is) output_.OnAlarm(alarm.spec, is ? AlarmState::kLive : AlarmState::kAbsent, now);
    }
  }
  // Ends the emergencies whose bit is not set in the error register.
  // Code 0000h with a register that is not 0: one error has ended, others remain (CiA 301 7.2.7.1).
  void EndEmergencies(std::uint8_t error_register, MonoNs now) {
    std::erase_if(codes_, [&](std::uint16_t code) {
      const std::uint8_t bit = ClassOf(code).register_bit;
      const bool stays = bit == 0 ? error_register != 0 : (error_register & bit) != 0;
      if (!stays) output_.OnAlarm(EmergencyAlarm(code), AlarmState::kAbsent, now);
      return !stays;
    });
    if (error_register == 0 && std::exchange(more_, false)) {
      output_.OnAlarm(kMoreEmergencies, AlarmState::kAbsent, now);
    }
  }

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
