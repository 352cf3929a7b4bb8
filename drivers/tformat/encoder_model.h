#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast::tformat {

// The encoder's EEPROM: the user's cells 0..79 (all 0 at shipping) and the store of the single-turn zero, which
// share one wear. A write takes 18 ms, during which nothing else gets at the memory (TS5669 spec 6.1.1, 8.1, Table
// 4).
class EncoderEeprom {
 public:
  static constexpr std::uint8_t kCells = 80;
  static constexpr MonoNs kWriteTime = 18 * kMillisecond;
  static constexpr std::int64_t kRewrites = 100'000;  // "Total 100,000 times"

  // Completes what is due.
  void Advance(MonoNs now);
  [[nodiscard]] bool Busy(MonoNs now) const { return now < busy_until_; }

  // Only when not busy. A worn-out memory takes the time and keeps its old content.
  void Write(std::uint8_t cell, std::uint8_t data, MonoNs now);
  [[nodiscard]] std::uint8_t Read(std::uint8_t cell) const { return cells_.at(cell); }
  // Stores the zero: takes the time and the wear of a write. False when the memory is worn out.
  bool StoreZero(MonoNs now);
  // The supply fails: a write under way is lost.
  void PowerOff(MonoNs now);

  // From outside, without time or wear: what a cell held when the encoder was delivered, how worn it is.
  void Preset(std::uint8_t cell, std::uint8_t data) { cells_.at(cell) = data; }
  void SetWear(std::int64_t writes) { wear_ = writes; }

  [[nodiscard]] std::int64_t wear() const { return wear_; }
  [[nodiscard]] std::int64_t writes_done() const { return writes_done_; }
  [[nodiscard]] std::int64_t writes_lost() const { return writes_lost_; }

 private:
  struct CellWrite {
    std::uint8_t cell;
    std::uint8_t data;
  };
  [[nodiscard]] bool Wear(MonoNs now);

  std::array<std::uint8_t, kCells> cells_{};
  std::optional<CellWrite> under_way_;
  MonoNs busy_until_ = INT64_MIN;
  std::int64_t wear_ = 0;
  std::int64_t writes_done_ = 0;
  std::int64_t writes_lost_ = 0;
};

// Counts the requests of a reset: "transmit 10 times in one sequence with the interval of 40 ms or more" (TS5669
// spec 9). The strict reading: every other request, another reset too, ends the sequence; so does one that comes
// too early, and it does not begin a new one.
class ResetCounter {
 public:
  static constexpr int kTimes = 10;
  static constexpr MonoNs kInterval = 40 * kMillisecond;

  // A reset with data ID `id` arrived. Returns true if it completes a sequence; the next reset begins a new one.
  [[nodiscard]] bool OnReset(std::uint8_t id, MonoNs now);
  // Any other request, or a reset that the encoder refuses.
  void Break();

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] std::int64_t broken() const { return broken_; }        // sequences that ended before the tenth
  [[nodiscard]] std::int64_t too_early() const { return too_early_; }  // of these, by a request within 40 ms

 private:
  std::uint8_t id_ = 0;
  int count_ = 0;
  MonoNs last_ = 0;
  std::int64_t broken_ = 0;
  std::int64_t too_early_ = 0;
};

// The encoder behind the line: shaft, battery-backed turn counter, latched flags, EEPROM. Modelled after the TS5669
// N127 specification; where it is silent, docs/simulation.md states what was decided. Time is an argument and only
// moves forward: an instant before the last one counts as the last one.
class EncoderModel {
 public:
  struct Settings {
    int single_turn_bits = 17;
    int multi_turn_bits = 16;
    std::uint8_t encoder_id = 0x11;
    std::int64_t noise_counts = 0;  // of a reading, either way
    double zero_error_deg = 0.1;    // where the shaft reads after a zero: the maker allows 0 +- 0.35 deg
    std::uint64_t seed = 1;
  };
  enum class CountingError : std::uint8_t {
    kNone,
    kLive,     // case I of spec 6.4: lasts as long as the deviation
    kLatched,  // case II: until a reset or power-off
  };
  // What the encoder would transmit at an instant.
  struct Reading {
    std::uint32_t single_turn = 0;
    std::uint32_t multi_turn = 0;
    std::uint8_t encoder_id = 0;
    bool over_speed = false;
    bool full_absolute = false;
    bool counting_error = false;
    bool counter_overflow = false;
    bool multi_turn_error = false;
    bool battery_error = false;
    bool battery_alarm = false;
  };
  // What was really done to the encoder since it was made.
  struct Effects {
    std::int64_t zeroings = 0;
    std::int64_t turn_resets = 0;
    std::int64_t error_clears = 0;      // by ID 7; a turn reset clears errors too, and counts there
    std::int64_t refused_zeroings = 0;  // requests of ID 8 while the shaft moved
  };

  static constexpr double kBatteryAlarmVolts = 3.1;  // spec 5.4, typical
  static constexpr double kBatteryErrorVolts = 2.5;
  static constexpr double kFullAbsoluteRpm = 100;  // spec 5.4.1
  static constexpr MonoNs kStandbyWithBattery = kSecond;
  static constexpr MonoNs kStandbyWithoutBattery = 1'500 * kMillisecond;

  // Powered since long ago, its turn counter at the turn in which `start` lies.
  EncoderModel(const Settings& settings, ShaftAngle start);

  void Advance(MonoNs now);

  // The latest instant seen.
  [[nodiscard]] MonoNs now() const { return now_; }

  // ---- the outside world ----
  [[nodiscard]] const Shaft& shaft() const { return shaft_; }
  // The shaft, to set a motion that begins at `now`.
  [[nodiscard]] Shaft& ShaftToTurn(MonoNs now);
  void SetPower(bool on, MonoNs now);
  void SetBattery(double volts, MonoNs now);  // 0: none
  void SetCountingError(CountingError error, MonoNs now);
  void JumpTurns(std::int64_t turns, MonoNs now);  // a bit-jump of the counter: ME
  void SetStuck(bool stuck, MonoNs now);           // the position stays what it is, whatever the shaft does
  [[nodiscard]] Settings& settings() { return settings_; }
  [[nodiscard]] const Settings& settings() const { return settings_; }

  // ---- the line ----
  [[nodiscard]] bool Accepts(MonoNs now) const { return powered_ && now >= ready_; }
  [[nodiscard]] Reading Read(MonoNs now);
  void OnReset(std::uint8_t data_id, MonoNs now);  // 7, 8 or C, after its reply was made
  void OnOtherRequest();
  [[nodiscard]] EncoderEeprom& eeprom() { return eeprom_; }
  [[nodiscard]] const EncoderEeprom& eeprom() const { return eeprom_; }

  // ---- state, for display and tests ----
  [[nodiscard]] bool powered() const { return powered_; }
  [[nodiscard]] double battery_volts() const { return battery_volts_; }
  [[nodiscard]] CountingError counting_error() const { return counting_error_; }
  [[nodiscard]] std::int64_t turns_jumped() const { return turns_jumped_; }
  [[nodiscard]] const Effects& effects() const { return effects_; }
  [[nodiscard]] const ResetCounter& reset_counter() const { return reset_counter_; }

 private:
  [[nodiscard]] bool HasBattery() const { return battery_volts_ > kBatteryErrorVolts; }
  [[nodiscard]] std::int64_t TurnsAt(ShaftAngle angle) const;
  void Track(MonoNs to);
  void TrackPowerOff(MonoNs from);
  void TrackOverflow(ShaftAngle lowest, ShaftAngle highest);
  [[nodiscard]] bool TooFastForPowerOff(MonoNs from, MonoNs to) const;
  void PowerOn(MonoNs now);
  void PowerOff(MonoNs now);
  void LatchBatteryError();
  void ClearLatches();
  void SetTurns(std::int64_t turns);
  void ExecuteZero();

  Settings settings_;
  Shaft shaft_;
  EncoderEeprom eeprom_;
  ResetCounter reset_counter_;
  SeededRandom random_;
  MonoNs now_ = 0;

  bool powered_ = true;
  MonoNs ready_ = INT64_MIN;  // end of standby
  MonoNs powered_off_ = 0;
  double battery_volts_ = 3.6;
  bool memory_lost_ = false;  // neither supply nor battery since the last power-on
  bool lost_turn_ = false;    // the counter has missed a turn since the last power-off

  ShaftAngle zero_offset_ = 0;       // kept in the EEPROM
  std::int64_t turn_offset_ = 0;     // kept by the battery
  std::int64_t overflow_epoch_ = 0;  // of the counter at the last look
  MonoNs zero_at_ = kNever;          // a zero is being stored
  bool moved_ = false;               // since the last request of ID 8
  std::optional<ShaftAngle> stuck_;

  bool over_speed_ = false;
  bool full_absolute_ = false;
  CountingError counting_error_ = CountingError::kNone;
  bool counter_overflow_ = false;
  bool overflow_dead_ = false;  // since a battery error, until the turns are reset (spec 5.4.2, Note 4)
  bool multi_turn_error_ = false;
  bool battery_error_ = false;
  std::int64_t turns_jumped_ = 0;
  Effects effects_;
};

// ---- requests ----

// What the encoder makes of the bytes of one request. Written from Tables 1, 5 and 6 of the TS5669 N127
// specification on its own, sharing nothing with the codec: a mistake in one does not hide in the other.
struct SimulatedRequest {
  enum class Verdict : std::uint8_t {
    kIncomplete,  // more bytes must follow
    kNoSync,      // the first byte has a wrong sink code: no frame begins here
    kAbnormal,    // answered with data ID 3's data
    kGood,
  };
  Verdict verdict = Verdict::kIncomplete;
  std::size_t size = 0;       // bytes used
  std::uint8_t field = 0;     // the control field as received
  std::uint8_t data_id = 0;   // 0x0..0xF, its ID code
  bool parity_error = false;  // of the ID: communication alarm ca0
  std::uint8_t address = 0;   // of data ID 6 and D
  std::uint8_t data = 0;      // of data ID 6
};

// `complete`: no further byte follows, so that a request which is too short is abnormal. `bytes` is not empty.
[[nodiscard]] SimulatedRequest CheckRequest(Bytes bytes, bool complete);

// The control field of a data ID in Table 1.
[[nodiscard]] std::uint8_t TableControlField(std::uint8_t data_id);

}  // namespace axlecast::tformat
