#include "drivers/tsubaki_sc/interpreter.h"

#include <axlecast/alarm_entry_t.hpp>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {
namespace {

constexpr std::uint8_t kDevice = alarm_entry_t::SOURCE_DEVICE;
constexpr std::uint8_t kDriver = alarm_entry_t::SOURCE_DRIVER;
constexpr std::uint8_t kWarning = alarm_entry_t::SEVERITY_WARNING;
constexpr std::uint8_t kError = alarm_entry_t::SEVERITY_ERROR;

constexpr const char* kTooMuch = "Tripped: look for an overload or a jam, see the trip log, then start again";
constexpr const char* kTooLittle = "Tripped: look for a lost load, a broken chain or belt; see the trip log";

constexpr std::array<MotorAlarm, 6> kAlarms = {{
    {0x01, {0x200, kDevice, kError, "power_upper_limit_a", kTooMuch}},
    {0x02, {0x201, kDevice, kError, "power_upper_limit_b", kTooMuch}},
    {0x04, {0x202, kDevice, kError, "power_lower_limit_a", kTooLittle}},
    {0x08, {0x203, kDevice, kError, "power_lower_limit_b", kTooLittle}},
    {0x20,
     {0x205, kDevice, kError, "overheat", "Tripped: the unit is extremely hot; let it cool, look for the cause"}},
    {0x40,
     {0x206, kDevice, kError, "excessive_shock",
      "Tripped: look for a collision or a loose part; see the trip log"}},
}};

}  // namespace

const std::array<MotorAlarm, 6>& MotorAlarms() { return kAlarms; }

const AlarmSpec kWrongPassword = {
    0x210, kDriver, kWarning, "wrong_password",
    "The unit refused the password: correct its file, then `log_in`. Not tried again"};
const AlarmSpec kLoginFailed = {0x211, kDriver, kWarning, "login_failed",
                                "motor_control needs the unit logged in, but it is not: run `log_in` to see why"};

const AlarmSpec kStillLoggedIn = {0x212, kDriver, kWarning, "still_logged_in",
                                  "The unit could not be logged out: run `log_out` to see why"};

std::string StatusText(std::int32_t bits) {
  std::string text = Text("0x%02X", static_cast<unsigned>(bits));
  for (const MotorAlarm& alarm : kAlarms) {
    if ((bits & alarm.bit) != 0) text.append(" ").append(alarm.spec.name);
  }
  return text;
}

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
  if (block == kSetValues) return OnSetValues(answer);
  if (block.read == kLogInterval.read && block.first <= kLogIntervalAddress) OnParameters(answer);
}

// Guideline 10: electric power upper limit A and B, lower limit A and B, start time, shock times in the same order.
void Interpreter::OnSetValues(const Answer& answer) {
  const auto tenths = [&](std::size_t index) { return static_cast<float>(answer.reply.Register(index)) / 10.0F; };
  limits_.at = answer.at;
  limits_.power_upper_w = {tenths(0), tenths(1)};
  limits_.power_lower_w = {tenths(2), tenths(3)};
  limits_.start_time_s = tenths(4);
  limits_.shock_time_upper_s = {tenths(5), tenths(6)};
  limits_.shock_time_lower_s = {tenths(7), tenths(8)};
  output_.OnMotorLimits(limits_);
}

void Interpreter::OnParameters(const Answer& answer) {
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

void Interpreter::OnAnalog(const Answer& answer) {
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

void Interpreter::OnVersion(const Answer& answer) {
  firmware_ = VersionText(answer.reply.data);
  output_.OnIdentity(product_, serial_, firmware_);
}

}  // namespace axlecast::tsubaki_sc
