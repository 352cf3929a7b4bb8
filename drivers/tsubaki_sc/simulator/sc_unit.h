#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
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
// Returns the block that holds the address; null if the unit has no such address.
[[nodiscard]] const Block* BlockAt(Space space, std::uint16_t address);

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
  [[nodiscard]] bool Authenticate(std::string_view password);
  void LogOut() { logged_in_ = false; }
  [[nodiscard]] bool logged_in() const { return logged_in_; }

  void SetPassword(std::string password) { password_ = std::move(password); }
  [[nodiscard]] Characters password() const;  // padded with NUL

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
  void Advance(MonoNs now);
  [[nodiscard]] MonoNs now() const { return now_; }

  void SetPower(bool on);
  [[nodiscard]] bool powered() const { return powered_; }
  void ResetTrip() { motor_status_ = 0; }  // the motor stays stopped until it is started
  // Trips the motor now by one cause, with a last log sample that shows it. Returns false if the motor does not run.
  [[nodiscard]] bool ForceTrip(std::uint16_t cause);
  // Freezes the instantaneous data, whatever the motor does.
  void SetStuck(bool stuck);
  void PresetParameter(std::uint16_t address, std::uint16_t value) { parameters_.at(address) = value; }

  // ---- data by address; each of them exists ----
  [[nodiscard]] bool Coil(std::uint16_t address) const { return address == kCoilStop && stop_; }
  [[nodiscard]] bool InputStatus() const { return settings.mains_60_hz; }
  [[nodiscard]] std::uint16_t InputRegister(std::uint16_t address) const;
  [[nodiscard]] std::uint16_t HoldingRegister(std::uint16_t address) const;
  void WriteCoil(std::uint16_t address, bool on);
  void WriteParameter(std::uint16_t address, std::uint16_t value);
  // Returns false and does nothing if the password is wrong.
  [[nodiscard]] bool WriteLogin(const std::string& password);
  void WritePassword(std::string password);
  // Returns two characters as a register of this unit.
  [[nodiscard]] std::uint16_t Pair(std::uint8_t first, std::uint8_t second) const;

  [[nodiscard]] Limits CurrentLimits() const;
  [[nodiscard]] std::uint16_t motor_status() const { return motor_status_; }
  [[nodiscard]] std::uint16_t trip_count() const { return trip_count_; }
  [[nodiscard]] const TripLogs& logs() const { return logs_; }

 private:
  void PowerOn();
  void StartMotor();
  void Step();
  void Trip(std::uint16_t causes);
  [[nodiscard]] std::uint16_t SetParameter(std::size_t index) const;
  [[nodiscard]] std::uint16_t LogSample(std::uint16_t address) const;

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
