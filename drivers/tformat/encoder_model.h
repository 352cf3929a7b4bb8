#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "drivers/kit/simulation/shaft.h"
#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/tformat/encoder_eeprom.h"
#include "drivers/tformat/reset_counter.h"

namespace axlecast::tformat {

// The encoder behind the line: shaft, battery-backed turn counter, latched flags, EEPROM. Modelled after the TS5669
// N127 specification; where it is silent, docs/simulation.md says what was decided. Time is an argument and only
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
  // To order a motion that begins at now().
  [[nodiscard]] Shaft& BusSlot(MonoNs now);
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

  // ---- for whoever looks on ----
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

}  // namespace axlecast::tformat
