#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "core/device/family.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// "After sending the command, wait at least 0.1 second before sending the next command" (guideline 3): the guideline
// does not define between which events, and whether for the unit or the bus.
enum class PacingReading : std::uint8_t {
  kAfterReply,    // A: of the whole bus, from the end of a reply: safe in every case
  kAfterRequest,  // L: of the whole bus, from the end of a request
  kPerUnit,       // W: of one unit, from the end of its reply
};

inline constexpr MonoNs kCommandPause = 100 * kMillisecond;  // guideline 3
inline constexpr MonoNs kSilentInterval = 5 * kMillisecond;  // guideline 4, note 1
inline constexpr int kLastAddress = 16;                      // guideline 2

// Guideline 2: fixed in the unit.
inline constexpr LineFormat kUnitLine = {.baud = 9600, .parity = Parity::kEven, .stop_bits = 1};

// The family's keys of a bus: README.md, "Configuration".
struct ScBus final : FamilyBus {
  PacingReading reading = PacingReading::kAfterReply;
  std::size_t units = 1;  // configured on the bus
};

// What a command may do to the motor.
enum class MotorControl : std::uint8_t { kNone, kStop, kStartStop };

// Whether live data pause while the log of a new trip is fetched.
enum class TripFetchMode : std::uint8_t { kSuspendLive, kAlternate };

// The family's keys of one unit: README.md, "Configuration".
struct ScSettings final : DeviceSettings {
  std::uint8_t address = 1;
  MotorControl motor_control = MotorControl::kNone;
  std::map<std::string, SecretPlace, std::less<>> passwords;
  std::string password;  // the one in use; empty: none
  PasswordFormat password_format;
  bool log_out = true;  // after each command that logged the unit in
  TripFetchMode trip_fetch = TripFetchMode::kSuspendLive;
  MonoNs timeout = 0;

  // Returns whether the driver logs the unit in by itself and never logs it out.
  [[nodiscard]] bool StaysLoggedIn() const { return motor_control != MotorControl::kNone && !log_out; }
};

[[nodiscard]] std::shared_ptr<const FamilyBus> ParseBusSettings(ConfigMap& map, const BusConfig& bus);
[[nodiscard]] std::unique_ptr<DeviceSettings> ParseSettings(ConfigMap& device, const BusConfig& bus);
// Reports an error for every address that two units share.
void CheckAddresses(ConfigMap& map, const BusConfig& bus);

// Returns the bus time of the live data of one unit (two requests), pauses included.
[[nodiscard]] MonoNs LiveCycle(PacingReading reading, std::size_t units);

}  // namespace axlecast::tsubaki_sc
