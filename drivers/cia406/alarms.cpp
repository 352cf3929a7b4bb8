#include "drivers/cia406/alarms.h"

#include <algorithm>
#include <array>
#include <axlecast/alarm_entry_t.hpp>
#include <utility>

#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

constexpr const char* kSeeManual = "Set by the encoder: its manual says what the bit means";

constexpr std::array<DiagnosticAlarm, 7> kAlarmTable = {{
    {0x0001,
     {0x120, kDevice, kCritical, "position_error", "The position may be wrong: stop the axis, check the encoder"}},
    {0x0002,
     {0x121, kDevice, kError, "commissioning_error", "Commissioning diagnostics failed: check the encoder"}},
    {0x0FFC,
     {0x122, kDevice, kError, "reserved_alarm", "A bit of 6503h that the profile reserves: read_state shows it"}},
    {0x1000, {0x12C, kDevice, kError, "manufacturer_alarm_12", kSeeManual}},
    {0x2000, {0x12D, kDevice, kError, "manufacturer_alarm_13", kSeeManual}},
    {0x4000, {0x12E, kDevice, kError, "manufacturer_alarm_14", kSeeManual}},
    {0x8000, {0x12F, kDevice, kError, "manufacturer_alarm_15", kSeeManual}},
}};

constexpr std::array<DiagnosticAlarm, 8> kWarningTable = {{
    {0x0001,
     {0x130, kDevice, kWarning, "frequency_exceeded", "The shaft turns faster than the encoder allows: slow down"}},
    {0x0002,
     {0x131, kDevice, kWarning, "light_control_reserve", "The light source is near its end: plan to replace it"}},
    {0x0004,
     {0x132, kDevice, kWarning, "cpu_watchdog",
      "The encoder's processor was reset: watch it, replace it if it recurs"}},
    {0x0008,
     {0x133, kDevice, kWarning, "operating_time_limit",
      "The encoder has reached its operating time: plan to replace it"}},
    {0x0010, {0x134, kDevice, kWarning, "battery_charge", "The encoder's battery is low: replace it"}},
    {0x0020,
     {0x135, kDevice, kWarning, "reference_not_reached", "The reference point has not been passed since power-on"}},
    {0x0FC0,
     {0x136, kDevice, kWarning, "reserved_warning",
      "A bit of 6505h that the profile reserves: read_state shows it"}},
    {0xF000, {0x13C, kDevice, kWarning, "manufacturer_warning", kSeeManual}},
}};

struct ClassAlarm {
  std::uint8_t first;  // upper byte of the error code
  std::uint8_t last;
  const char* name;
  std::uint8_t register_bit;
};

// Classes of CiA 301 table 26, bits of 1001h (7.5.2.2).
constexpr std::array<ClassAlarm, 12> kClasses = {{
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
}};

const ClassAlarm* ClassOf(std::uint16_t error_code) {
  const auto upper = static_cast<std::uint8_t>(error_code >> 8);
  for (const ClassAlarm& known : kClasses) {
    if (upper >= known.first && upper <= known.last) return &known;
  }
  return nullptr;
}

constexpr std::int32_t kFirstEmergency = 0x10000;

std::uint16_t MaskOf(std::optional<std::uint32_t> supported) {
  return static_cast<std::uint16_t>(supported ? *supported | kStandardBits : 0xFFFFU);
}

}  // namespace

std::span<const DiagnosticAlarm> Alarms() { return kAlarmTable; }
std::span<const DiagnosticAlarm> Warnings() { return kWarningTable; }

AlarmSpec EmergencyAlarm(std::uint16_t error_code) {
  const ClassAlarm* known = ClassOf(error_code);
  return {kFirstEmergency + error_code, kDevice, kError, known == nullptr ? "emergency" : known->name,
          "The code's last four hex digits are the error code: read_state, encoder's manual"};
}

std::uint8_t RegisterBitOf(std::uint16_t error_code) {
  const ClassAlarm* known = ClassOf(error_code);
  return known == nullptr ? 0 : known->register_bit;
}

const AlarmSpec kWrongEncoder = {0x140, kDriver, kCritical, "wrong_encoder",
                                 "Not the encoder or setting of the file: DEVICE says what differs"};
const AlarmSpec kHeartbeatLost = {0x141, kDriver, kError, "heartbeat_lost",
                                  "No heartbeat within heartbeat_ms: check supply, cable, object 1017h"};
const AlarmSpec kNotOperational = {0x142, kDriver, kError, "not_operational",
                                   "The node sends no positions: nmt_start, or another master stopped it"};
const AlarmSpec kSecondSync = {0x143, kDriver, kWarning, "second_sync_producer",
                               "Another node sends SYNC too: only one may; transmission: as_configured"};
const AlarmSpec kPeriodDiffers = {0x144, kDriver, kWarning, "period_differs",
                                  "The encoder's event timer (1800h sub 5) is not period_ms: change one"};
const AlarmSpec kMoreEmergencies = {0x145, kDevice, kError, "more_emergencies",
                                    "The encoder reports more error codes than are shown: read_state"};

void NodeAlarms::Begin(const NodeFacts& facts, MonoNs now) {
  alarm_mask_ = MaskOf(facts.Get(kSupportedAlarms));
  warning_mask_ = MaskOf(facts.Get(kSupportedWarnings));
  OnAlarms(facts.Get(kAlarms).value_or(0), now);
  OnWarnings(facts.Get(kWarnings).value_or(0), now);
}

void NodeAlarms::OnAlarms(std::uint32_t bits, MonoNs now) {
  const auto heeded = static_cast<std::uint16_t>(bits & alarm_mask_);
  Report(Alarms(), std::exchange(alarms_, heeded), heeded, now);
}

void NodeAlarms::OnWarnings(std::uint32_t bits, MonoNs now) {
  const auto heeded = static_cast<std::uint16_t>(bits & warning_mask_);
  Report(Warnings(), std::exchange(warnings_, heeded), heeded, now);
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
  auto* const end = codes_.begin() + count_;
  if (std::find(codes_.begin(), end, emergency.code) != end) return;
  if (count_ == kMaxCodes) {
    if (!std::exchange(more_, true)) output_.OnAlarm(kMoreEmergencies, AlarmState::kLive, now);
    return;
  }
  codes_.at(count_++) = emergency.code;
  output_.OnAlarm(EmergencyAlarm(emergency.code), AlarmState::kLive, now);
}

// With 0000h and a register that is not 0, one error is gone and others are left (CiA 301 7.2.7.1).
void NodeAlarms::EndEmergencies(std::uint8_t error_register, MonoNs now) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::uint16_t code = codes_.at(i);
    const std::uint8_t bit = RegisterBitOf(code);
    const bool stays = bit == 0 ? error_register != 0 : (error_register & bit) != 0;
    if (stays) {
      codes_.at(kept++) = code;
    } else {
      output_.OnAlarm(EmergencyAlarm(code), AlarmState::kAbsent, now);
    }
  }
  count_ = kept;
  if (error_register == 0 && std::exchange(more_, false)) {
    output_.OnAlarm(kMoreEmergencies, AlarmState::kAbsent, now);
  }
}

void NodeAlarms::OnBootUp(MonoNs now) {
  EndEmergencies(0, now);
  last_.reset();
}

}  // namespace axlecast::cia406
