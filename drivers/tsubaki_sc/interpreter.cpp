#include "drivers/tsubaki_sc/interpreter.h"

#include "drivers/tsubaki_sc/alarms.h"

namespace axlecast::tsubaki_sc {

void Interpreter::Forget() {
  reading_.stop_coil = -1;
  reading_.logged_in = -1;
  reading_.mains_hz = 0;
}

void Interpreter::OnAnswer(const Answer& answer) {
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

void Interpreter::OnRegisters(const Answer& answer) {
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
  const std::size_t end = std::size_t{block.first} + block.count;
  if (block.read == kLogInterval.read && block.first <= kLogIntervalAddress && end > kLogIntervalAddress) {
    trips_.OnLogInterval(answer.reply.Register(std::size_t{kLogIntervalAddress} - block.first));
  }
}

void Interpreter::OnAnalog(const Answer& answer) {
  const auto value = [&](std::size_t index) {
    return ToUnits(kQuantityTable[index], answer.reply.Register(index));
  };
  reading_.analog_at = answer.at;
  reading_.voltage_v = value(0);
  reading_.current_a = value(1);
  reading_.power_w = value(2);
  reading_.temperature_c = value(3);
  reading_.accel_mps2 = {value(4), value(5), value(6)};
  unpublished_ = true;
}

void Interpreter::OnStatus(const Answer& answer) {
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

void Interpreter::Publish() {
  unpublished_ = false;
  output_.OnMotor(reading_);
}

void Interpreter::OnIdentity(const Answer& answer) {
  if (*answer.block == kProductCode) {
    product_ = (std::int64_t{answer.reply.Register(0)} << 16) | answer.reply.Register(1);
  } else {
    std::string serial = RegisterText(answer.reply.data, order_);
    if (!serial_.empty() && serial != serial_) trips_.Forget();
    serial_ = std::move(serial);
  }
  output_.OnIdentity(product_, serial_, firmware_);
}

void Interpreter::OnVersion(const Answer& answer) {
  firmware_ = VersionText(answer.reply.data);
  output_.OnIdentity(product_, serial_, firmware_);
}

}  // namespace axlecast::tsubaki_sc
