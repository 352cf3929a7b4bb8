#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "drivers/tsubaki_sc/simulator/gear_motor.h"
#include "drivers/tsubaki_sc/simulator/protection.h"

namespace axlecast::tsubaki_sc::simulator {

// The data address list, guideline 7.
enum class Space : std::uint8_t { kCoil, kInputStatus, kInputRegister, kHoldingRegister };

inline constexpr std::uint16_t kCoilClearTripCount = 0;
inline constexpr std::uint16_t kCoilStop = 100;
inline constexpr std::uint16_t kCoilStart = 200;
inline constexpr std::uint16_t kParameters = 0;  // holding registers
inline constexpr std::uint16_t kParameterCount = 55;
inline constexpr std::size_t kParametersPerSet = 13;
inline constexpr std::uint16_t kOverheatLimit = 52;
inline constexpr std::uint16_t kExcessiveShockLimit = 53;
inline constexpr std::uint16_t kLogInterval = 54;
inline constexpr std::uint16_t kLoginLogout = 100;
inline constexpr std::uint16_t kPassword = 200;
inline constexpr std::uint16_t kProductCode = 300;
inline constexpr std::uint16_t kMfgNumber = 350;

struct Block {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  bool writable = false;
  bool whole = false;  // *1: only all of it at once

  [[nodiscard]] std::uint32_t size() const { return last - first + 1U; }
};
// Returns the block that holds the address, or nothing if the unit has no such address.
[[nodiscard]] std::optional<Block> BlockAt(Space space, std::uint16_t address);

// Lower and upper limit of a parameter: guideline 11.
struct Range {
  std::uint16_t low = 0;
  std::uint16_t high = 0;
};
[[nodiscard]] Range ParameterRange(std::uint16_t address);

// The 16 characters of a login or password write, and whether they can be a password: 8 to 16 characters of
// 0x21..0x7E, the rest NUL or SP (guideline 11).
using Characters = std::array<std::uint8_t, 16>;
struct WrittenPassword {
  bool length_fits = false;     // the text before the padding is 8 to 16 characters long
  bool characters_fit = false;  // and holds only what a password may hold
  std::string text;
};
[[nodiscard]] WrittenPassword Unpadded(const Characters& characters);

// The login state and the password. A power-off ends the login and keeps the password.
class Access {
 public:
  // The right password changes the login state. Returns false for another one, which changes nothing.
  [[nodiscard]] bool Authenticate(std::string_view password) {
    if (password != password_) return false;
    logged_in_ = !logged_in_;
    return true;
  }
  void LogOut() { logged_in_ = false; }
  [[nodiscard]] bool logged_in() const { return logged_in_; }

  void SetPassword(std::string password) { password_ = std::move(password); }
  [[nodiscard]] Characters password() const {
    Characters characters{};
    std::copy(password_.begin(), password_.end(), characters.begin());
    return characters;
  }  // padded with NUL

 private:
  std::string password_ = "password";  // guideline 2
  bool logged_in_ = false;
};

// One SC unit with its motor as the communication guideline describes it, without its line. README.md of this folder
// states what the guideline does not define.
class ScUnit {
 public:
  // The reaction to a write of a parameter out of its range: the guideline does not define it.
  enum class OutOfRange : std::uint8_t { kRefuse, kKeep, kClamp };
  struct Settings {
    int dip_set = 1;  // 1..4
    bool mains_60_hz = false;
    std::array<std::uint8_t, 2> version{0x01, 0x00};  // upper, lower
    std::string product_code = "SC01";                // 4 characters
    std::string mfg_number = "0000000001";            // 10 characters
    OutOfRange out_of_range = OutOfRange::kRefuse;
    bool low_byte_first = false;       // of a register on the line
    bool low_character_first = false;  // of the two characters in a register
  };
  // What was done to the unit since the start.
  struct Effects {
    std::int64_t starts = 0;
    std::int64_t stops = 0;
    std::int64_t logins = 0;
    std::int64_t logouts = 0;  // by the password, not by power-off
    std::int64_t wrong_passwords = 0;
    std::int64_t password_changes = 0;
    std::int64_t parameter_writes = 0;
    std::int64_t trip_count_clears = 0;
  };

  Settings settings;
  GearMotor motor;
  Access access;
  Effects effects;

  explicit ScUnit(std::uint64_t seed);

  // The first call powers the unit on. Time must not run backwards.
  void Advance(MonoNs now) {
    if (!begun_) {
      begun_ = true;
      now_ = stepped_ = now;
      if (powered_) PowerOn();
      return;
    }
    while (now - stepped_ >= GearMotor::kStep) {
      stepped_ += GearMotor::kStep;
      now_ = stepped_;
      Step();
    }
    now_ = std::max(now_, now);
  }
  [[nodiscard]] MonoNs now() const { return now_; }

  void SetPower(bool on) {
    if (on == powered_) return;
    powered_ = on;
    if (!begun_) return;
    if (on) return PowerOn();
    motor.Stop();
    access.LogOut();
  }
  [[nodiscard]] bool powered() const { return powered_; }
  void ResetTrip() { motor_status_ = 0; }  // the motor stays stopped until it is started
  // Trips the motor now by one cause, with a last log sample that shows it. Returns false if the motor does not run.
  [[nodiscard]] bool ForceTrip(std::uint16_t cause) {
    if (!powered_ || !motor.running()) return false;
    const Limits limits = CurrentLimits();
    Record record = RecordOf(motor.At(now_));
    const auto above = [](int limit, int present) {
      return static_cast<std::uint16_t>(std::max(limit, present) + 1);
    };
    if (cause == kOverheat) {
      record[kTemperatureIndex] = above(limits.overheat, static_cast<std::int16_t>(record[kTemperatureIndex]));
    } else if (cause == kExcessiveShock) {
      record[kAccelIndex] = above(limits.excessive_shock, 0);
    } else if (cause == kUpperA || cause == kUpperB) {
      record[kPowerIndex] = above(limits.power[cause == kUpperA ? 0 : 1], record[kPowerIndex]);
    } else {
      const std::uint16_t limit = limits.power[cause == kLowerA ? 2 : 3];
      if (limit != 0)
        record[kPowerIndex] = std::min<std::uint16_t>(record[kPowerIndex], static_cast<std::uint16_t>(limit - 1));
    }
    history_.ReplaceNewest(record);
    Trip(cause);
    return true;
  }
  // Freezes the instantaneous data, whatever the motor does.
  void SetStuck(bool stuck) {
    if (!stuck) {
      stuck_.reset();
    } else if (!stuck_) {
      stuck_ = RecordOf(motor.At(now_));
    }
  }
  void PresetParameter(std::uint16_t address, std::uint16_t value) { parameters_.at(address) = value; }

  // ---- data by address; each of them exists ----
  [[nodiscard]] bool Coil(std::uint16_t address) const { return address == kCoilStop && stop_; }
  [[nodiscard]] bool InputStatus() const { return settings.mains_60_hz; }
  [[nodiscard]] std::uint16_t InputRegister(std::uint16_t address) const {
    if (address <= 8) return SetParameter(address);
    if (address >= 1000) return LogSample(address);
    if (address <= 106) return (stuck_ ? *stuck_ : RecordOf(motor.At(now_))).at(address - 100U);
    switch (address) {
      case 200:
        return trip_count_;
      case 201:
        return motor_status_;
      case 300:
        return access.logged_in() ? 0xFF00 : 0;
      default:
        return logs_.factor(address - 202U);
    }
  }
  [[nodiscard]] std::uint16_t HoldingRegister(std::uint16_t address) const {
    if (address < kParameterCount) return parameters_[address];
    if (address < kPassword) return 0;  // Login/Logout reads as NUL
    if (address < kProductCode) {
      const Characters characters = access.password();
      const std::size_t at = 2 * static_cast<std::size_t>(address - kPassword);
      return Pair(characters.at(at), characters.at(at + 1));
    }
    const bool product = address < kMfgNumber;
    const std::string& text = product ? settings.product_code : settings.mfg_number;
    const std::size_t at = 2 * static_cast<std::size_t>(address - (product ? kProductCode : kMfgNumber));
    const auto character = [&](std::size_t index) {
      return index < text.size() ? static_cast<std::uint8_t>(text[index]) : std::uint8_t{0};
    };
    return Pair(character(at), character(at + 1));
  }
  void WriteCoil(std::uint16_t address, bool on) {
    if (!on) return;
    switch (address) {
      case kCoilClearTripCount:
        trip_count_ = 0;
        ++effects.trip_count_clears;
        break;
      case kCoilStop:
        if (motor.running()) ++effects.stops;
        stop_ = true;
        motor.Stop();
        break;
      default:
        stop_ = false;
        if (motor_status_ == 0) StartMotor();
        break;
    }
  }
  void WriteParameter(std::uint16_t address, std::uint16_t value) {
    const Range range = ParameterRange(address);
    ++effects.parameter_writes;
    if (settings.out_of_range == OutOfRange::kKeep && (value < range.low || value > range.high)) return;
    parameters_.at(address) = std::clamp(value, range.low, range.high);
  }
  // Returns false and does nothing if the password is wrong.
  [[nodiscard]] bool WriteLogin(const std::string& password) {
    if (!access.Authenticate(password)) {
      ++effects.wrong_passwords;
      return false;
    }
    ++(access.logged_in() ? effects.logins : effects.logouts);
    return true;
  }
  void WritePassword(std::string password) {
    access.SetPassword(std::move(password));
    ++effects.password_changes;
  }
  // Returns two characters as a register of this unit.
  [[nodiscard]] std::uint16_t Pair(std::uint8_t first, std::uint8_t second) const {
    if (settings.low_character_first) std::swap(first, second);
    return static_cast<std::uint16_t>(first << 8U | second);
  }

  [[nodiscard]] Limits CurrentLimits() const {
    Limits limits;
    for (std::size_t i = 0; i < 4; ++i) {
      limits.power.at(i) = SetParameter(i);
      limits.shock_time.at(i) = SetParameter(5 + i);
    }
    limits.start_time = SetParameter(4);
    limits.overheat = parameters_[kOverheatLimit];
    limits.excessive_shock = parameters_[kExcessiveShockLimit];
    return limits;
  }
  [[nodiscard]] std::uint16_t motor_status() const { return motor_status_; }
  [[nodiscard]] std::uint16_t trip_count() const { return trip_count_; }
  [[nodiscard]] const TripLogs& logs() const { return logs_; }

 private:
  void PowerOn() {
    stop_ = false;
    motor_status_ = 0;
    history_.Clear();
    StartMotor();
  }
  void StartMotor() {
    if (motor.running()) return;
    ++effects.starts;
    motor.Start(now_);
    protection_.Begin(now_);
  }
  void Step() {
    motor.Step(now_);
    if (!powered_) return;
    const Record record = RecordOf(motor.At(now_));
    history_.Add(record);
    if (!motor.running()) return;
    const std::uint16_t causes = protection_.Causes(record, CurrentLimits(), now_);
    if (causes != 0) Trip(causes);
  }
  void Trip(std::uint16_t causes) {
    motor.Stop();
    motor_status_ = causes;
    if (trip_count_ < UINT16_MAX) ++trip_count_;
    logs_.Shift(causes, history_, parameters_[kLogInterval]);
  }
  // Guideline 11: of each DIP switch setting, four power limits for 50 and 60 Hz alternately, the start time, four shock
  // times.
  [[nodiscard]] std::uint16_t SetParameter(std::size_t index) const {
    const std::size_t first = kParametersPerSet * (static_cast<std::size_t>(settings.dip_set) - 1);
    const std::size_t mains = settings.mains_60_hz ? 1 : 0;
    return parameters_.at(first + (index < 4 ? 2 * index + mains : index + 4));
  }
  [[nodiscard]] std::uint16_t LogSample(std::uint16_t address) const {
    return logs_.sample(address / 1000U - 1U, address / 100U % 10U, address % 100U);
  }

  bool begun_ = false;
  bool powered_ = true;
  MonoNs now_ = 0;
  MonoNs stepped_ = 0;  // the last step; steps are a grid from the start
  std::array<std::uint16_t, kParameterCount> parameters_{};
  bool stop_ = false;  // the coil
  std::uint16_t motor_status_ = 0;
  std::uint16_t trip_count_ = 0;
  std::optional<Record> stuck_;
  Protection protection_;
  History history_;
  TripLogs logs_;
};

// ---- commands ----

// Error codes of guideline 5; the lowest that applies is answered.
enum class ErrorCode : std::uint8_t { kFunction = 1, kAddress = 2, kData = 3, kLogin = 4 };

// Guideline 4, notes 1-7.
[[nodiscard]] std::uint16_t ErrorCheck(Bytes message);

// Returns the length of the command that begins so, with address and error check; 0 if it is not known yet, or if the
// function is not in guideline 6.
[[nodiscard]] std::size_t CommandLength(Bytes so_far);

// Executes a command and returns the response, both from the function code to the end of the data.
[[nodiscard]] std::vector<std::uint8_t> Execute(ScUnit& unit, Bytes command);
[[nodiscard]] std::vector<std::uint8_t> ErrorResponse(std::uint8_t function, std::uint8_t code);

// Returns whether a broadcast of this function is processed (guideline 6, note 2).
[[nodiscard]] bool IsWrite(std::uint8_t function);

}  // namespace axlecast::tsubaki_sc::simulator
