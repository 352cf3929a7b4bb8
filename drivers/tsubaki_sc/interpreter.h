#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

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

// Returns all of them.
[[nodiscard]] std::vector<AlarmSpec> Alarms();

// "0x02 power_upper_limit_b"
[[nodiscard]] std::string StatusText(std::int32_t bits);

// Reports motor readings, limits, alarms, identity and trips. They depend only on the answers, so a recorded sequence of
// events gives the same results.
class Interpreter {
 public:
  Interpreter(CharacterOrder order, DeviceOutput& output) : order_(order), output_(output), trips_(output) {}

  // The unit is gone: it may be logged out when it comes back, switched over, or be another one.
  void Forget() {
    reading_.stop_coil = -1;
    reading_.logged_in = -1;
    reading_.mains_hz = 0;
  }
  void OnAnswer(const Answer& answer) {
    if (!answer.block) return;
    if (!answer.ok()) {
      // The half that came is not held back because the other one did not.
      if (*answer.block == kStatus && unpublished_) Publish();
      return;
    }
    const Block& block = *answer.block;
    if (block == kStopCoil) {
      reading_.stop_coil = answer.reply.Bit(0) ? 1 : 0;
    } else if (block == kMains) {
      reading_.mains_hz = answer.reply.Bit(0) ? 60 : 50;
    } else {
      OnRegisters(answer);
    }
  }

  [[nodiscard]] const MotorReading& reading() const { return reading_; }
  [[nodiscard]] TripReader& trips() { return trips_; }
  [[nodiscard]] const TripReader& trips() const { return trips_; }

 private:
  void OnRegisters(const Answer& answer) {
    const Block& block = *answer.block;
    if (block == kAnalog) return OnAnalog(answer);
    if (block == kStatus) return OnStatus(answer);
    if (block == kLoginStatus) {
      reading_.logged_in = answer.reply.Register(0) == kSaysLoggedIn ? 1 : 0;
      return;
    }
    if (block == kMfgNumber || block == kProductCode) return OnIdentity(answer);
    if (block == kVersion) return OnVersion(answer);
    if (const auto place = LogPlaceOf(block)) return trips_.OnLog(*place, answer.reply, answer.at);
    if (block == kSetValues) return OnSetValues(answer);
    if (block.read == kLogInterval.read && block.first <= kLogIntervalAddress) OnParameters(answer);
  }
  void OnAnalog(const Answer& answer) {
    const auto value = [&](std::size_t index) {
      return static_cast<float>(ToUnits(kQuantityTable[index], answer.reply.Register(index)));
    };
    reading_.analog_at = answer.at;
    reading_.voltage_v = value(0);
    reading_.current_a = value(1);
    reading_.power_w = value(2);
    reading_.temperature_c = value(3);
    reading_.accel_mps2 = {value(4), value(5), value(6)};
    unpublished_ = true;
  }
  void OnStatus(const Answer& answer) {
    TripStatus status{.count = answer.reply.Register(0), .motor = answer.reply.Register(1), .factors = {}};
    for (std::size_t i = 0; i < kLogs; ++i) status.factors[i] = answer.reply.Register(2 + i);
    reading_.status_at = answer.at;
    reading_.trip_count = status.count;
    reading_.status_bits = status.motor;
    reading_.trip_factor = status.factors;
    reading_.tripped = (status.motor & kTripBits) != 0;
    for (const MotorAlarm& alarm : MotorAlarms()) {
      const bool live = (status.motor & alarm.bit) != 0;
      output_.OnAlarm(alarm.spec, live ? AlarmState::kLive : AlarmState::kAbsent, answer.end);
    }
    Publish();
    trips_.OnStatus(status, answer.at);
  }
  // Guideline 10: electric power upper limit A and B, lower limit A and B, start time, shock times in the same order.
  void OnSetValues(const Answer& answer) {
    const auto tenths = [&](std::size_t index) { return static_cast<float>(answer.reply.Register(index)) / 10.0F; };
    limits_.at = answer.at;
    limits_.power_upper_w = {tenths(0), tenths(1)};
    limits_.power_lower_w = {tenths(2), tenths(3)};
    limits_.start_time_s = tenths(4);
    limits_.shock_time_upper_s = {tenths(5), tenths(6)};
    limits_.shock_time_lower_s = {tenths(7), tenths(8)};
    output_.OnMotorLimits(limits_);
  }
  void OnParameters(const Answer& answer) {
    limits_.at = answer.at;
    for (const ParameterSpec& parameter : Parameters()) {
      const std::size_t address = parameter.address;
      if (address < answer.block->first || address >= std::size_t{answer.block->first} + answer.block->count)
        continue;
      const std::uint16_t value = answer.reply.Register(address - answer.block->first);
      limits_.parameters[address] = static_cast<float>(value) / (parameter.decimals == 2 ? 100.0F : 10.0F);
      if (address == kLogIntervalAddress) trips_.OnLogInterval(value);
    }
    limits_.overheat_c = limits_.parameters[kOverheatLimitAddress];
    limits_.shock_mps2 = limits_.parameters[kShockLimitAddress];
    limits_.log_interval_s = limits_.parameters[kLogIntervalAddress];
    output_.OnMotorLimits(limits_);
  }
  void OnIdentity(const Answer& answer) {
    if (*answer.block == kProductCode) {
      product_ = (std::int64_t{answer.reply.Register(0)} << 16) | answer.reply.Register(1);
      output_.OnProductCode(RegisterText(answer.reply.data, order_));
    } else {
      std::string serial = RegisterText(answer.reply.data, order_);
      if (!serial_.empty() && serial != serial_) {
        trips_.Forget();
        limits_ = {};
      }
      serial_ = std::move(serial);
    }
    output_.OnIdentity(product_, serial_, firmware_);
  }
  void OnVersion(const Answer& answer) {
    firmware_ = VersionText(answer.reply.data);
    output_.OnIdentity(product_, serial_, firmware_);
  }
  void Publish() {
    unpublished_ = false;
    output_.OnMotor(reading_);
  }

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
