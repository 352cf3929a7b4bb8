#include "drivers/saa_can/cia406/alarms.h"

#include <array>
#include <axlecast/alarm_entry_t.hpp>

namespace axlecast::saa_can::cia406 {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;
constexpr std::uint8_t kCritical = alarm_entry_t::SEVERITY_CRITICAL;

constexpr const char* kSeeManual = "Set by the encoder: its manual says what the bit means";

constexpr std::array<DiagnosticAlarm, 7> kAlarms = {{
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

constexpr std::array<DiagnosticAlarm, 8> kWarnings = {{
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

}  // namespace

std::span<const DiagnosticAlarm> Alarms() { return kAlarms; }
std::span<const DiagnosticAlarm> Warnings() { return kWarnings; }

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

}  // namespace axlecast::saa_can::cia406
