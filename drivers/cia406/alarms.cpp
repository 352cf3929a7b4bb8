#include "drivers/cia406/alarms.h"

#include <algorithm>
#include <array>
#include <utility>

#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

constexpr const char* kSeeManual = "Set by the encoder: its manual describes the bit";

constexpr std::array<DiagnosticAlarm, 7> kAlarmTable = {{
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

constexpr std::array<DiagnosticAlarm, 8> kWarningTable = {{
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
constexpr std::array<ClassAlarm, 13> kClasses = {{
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

const ClassAlarm& ClassOf(std::uint16_t error_code) {
  const int upper = error_code >> 8;
  return *std::find_if(kClasses.begin(), kClasses.end(),
                       [&](const ClassAlarm& known) { return upper >= known.first && upper <= known.last; });
}

constexpr std::int32_t kFirstEmergency = 0x10000;

// Bits with the same meaning in every encoder. The manufacturer's bits are used only if 6504h or 6506h shows that they exist.
constexpr std::uint16_t kStandardBits = 0x0FFF;

std::uint16_t MaskOf(std::optional<std::uint32_t> supported) {
  return static_cast<std::uint16_t>(supported ? *supported | kStandardBits : 0xFFFFU);
}

}  // namespace

std::span<const DiagnosticAlarm> Alarms() { return kAlarmTable; }
std::span<const DiagnosticAlarm> Warnings() { return kWarningTable; }

AlarmSpec EmergencyAlarm(std::uint16_t error_code) {
  return {kFirstEmergency + error_code, kOfDevice, kError, ClassOf(error_code).name,
          "The code's last four hex digits are the error code: read_state, encoder's manual"};
}

void NodeAlarms::Begin(const NodeFacts& facts, MonoNs now) {
  alarm_mask_ = MaskOf(facts.Get(kSupportedAlarms));
  warning_mask_ = MaskOf(facts.Get(kSupportedWarnings));
  OnAlarms(facts.Get(kAlarms).value_or(0), now);
  OnWarnings(facts.Get(kWarnings).value_or(0), now);
}

void NodeAlarms::OnAlarms(std::uint32_t bits, MonoNs now) {
  const auto used = static_cast<std::uint16_t>(bits & alarm_mask_);
  Report(Alarms(), std::exchange(alarms_, used), used, now);
}

void NodeAlarms::OnWarnings(std::uint32_t bits, MonoNs now) {
  const auto used = static_cast<std::uint16_t>(bits & warning_mask_);
  Report(Warnings(), std::exchange(warnings_, used), used, now);
}

void NodeAlarms::Report(std::span<const DiagnosticAlarm> table, std::uint16_t before, std::uint16_t now_set,
                        MonoNs now) {
  for (const DiagnosticAlarm& alarm : table) {
    const bool was = (before & alarm.bits) != 0;
    const bool is = (now_set & alarm.bits) != 0;
    if (was != is) output_.OnAlarm(alarm.spec, is ? AlarmState::kLive : AlarmState::kAbsent, now);
  }
}

void NodeAlarms::OnEmergency(const Emergency& emergency, MonoNs now) {
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

// Code 0000h with a register that is not 0: one error has ended, others remain (CiA 301 7.2.7.1).
void NodeAlarms::EndEmergencies(std::uint8_t error_register, MonoNs now) {
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

void NodeAlarms::OnBootUp(MonoNs now) {
  EndEmergencies(0, now);
  last_.reset();
}

}  // namespace axlecast::cia406
