#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/device/device.h"
#include "drivers/tsubaki_sc/requests.h"
#include "drivers/tsubaki_sc/trips.h"

namespace axlecast::tsubaki_sc {

// A bit of the motor status (AI 201) and of the trip factors (AI 202-204): guideline 10, note 1.
struct MotorAlarm {
  std::uint16_t bit;
  AlarmSpec spec;  // code 0x200 + the bit's number
};

// In the order of their bits.
[[nodiscard]] const std::array<MotorAlarm, 6>& MotorAlarms();

// All bits that the guideline names. One of them in the motor status: the motor is tripped.
inline constexpr std::uint16_t kTripBits = 0x6F;

extern const AlarmSpec kWrongPassword;
extern const AlarmSpec kLoginFailed;
extern const AlarmSpec kStillLoggedIn;

// "0x02 power_upper_limit_b"
[[nodiscard]] std::string StatusText(std::int32_t bits);

// Reports motor readings, limits, alarms, identity and trips. They depend only on the answers, so a recorded sequence of
// events gives the same results.
class Interpreter {
 public:
  Interpreter(CharacterOrder order, DeviceOutput& output) : order_(order), output_(output), trips_(output) {}

  // The unit is gone: it may be logged out when it comes back, switched over, or be another one.
  void Forget();
  void OnAnswer(const Answer& answer);

  [[nodiscard]] const MotorReading& reading() const { return reading_; }
  [[nodiscard]] TripReader& trips() { return trips_; }
  [[nodiscard]] const TripReader& trips() const { return trips_; }

 private:
  void OnRegisters(const Answer& answer);
  void OnAnalog(const Answer& answer);
  void OnStatus(const Answer& answer);
  void OnSetValues(const Answer& answer);
  void OnParameters(const Answer& answer);
  void OnIdentity(const Answer& answer);
  void OnVersion(const Answer& answer);
  void Publish();

  const CharacterOrder order_;
  DeviceOutput& output_;
  TripReader trips_;
  MotorReading reading_;
  MotorLimits limits_;
  bool unpublished_ = false;  // the analog half is newer than the last published reading
  std::int64_t product_ = -1;
  std::string serial_;
  std::string firmware_;
};

}  // namespace axlecast::tsubaki_sc
