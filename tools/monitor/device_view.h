#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/messages/sequence_count.h"

namespace axlecast {

// States are reported once per second. An older state is not used.
inline constexpr MonoNs kStaleAfter = 2500 * kMillisecond;

// The newest ALARM message of one sender, and the changes that led to it.
class AlarmView {
 public:
  static constexpr std::size_t kMaxChanges = 64;
  static constexpr std::size_t kMaxSeen = 100;  // anybody can publish names

  struct Change {
    std::int64_t utime = 0;  // of the message with the change
    bool appeared = false;   // false: gone
    alarm_entry_t entry;     // as last reported
  };

  // Takes a message. Returns true if the set of alarms or a state has changed.
  bool On(alarm_t message, MonoNs now);

  [[nodiscard]] bool heard() const { return heard_; }
  [[nodiscard]] bool Fresh(MonoNs now) const { return heard_ && now - at_ <= kStaleAfter; }
  [[nodiscard]] const std::vector<alarm_entry_t>& entries() const { return entries_; }  // worst first
  [[nodiscard]] std::size_t total() const { return total_; }  // also those that did not fit into the message
  [[nodiscard]] const std::deque<Change>& changes() const { return changes_; }  // the newest, oldest first
  [[nodiscard]] const std::set<std::string>& seen() const { return seen_; }     // names, since the start

 private:
  void Keep(std::int64_t utime, bool appeared, const alarm_entry_t& entry);

  std::vector<alarm_entry_t> entries_;
  std::size_t total_ = 0;
  std::deque<Change> changes_;
  std::set<std::string> seen_;
  MonoNs at_ = 0;
  bool heard_ = false;
};

// The state of one device from its messages.
struct DeviceView {
  static constexpr std::size_t kMaxTrips = 16;

  std::string name;
  std::string bus;
  bool listed = true;                    // in the machine file; false: only its messages were received
  bool has_position = true;              // false: a monitor, whose readings are MOTOR
  std::optional<position_t> position;    // the newest
  std::optional<position_t> valid;       // the newest with FLAG_VALID
  std::optional<motor_health_t> motor;   // the newest
  std::optional<motor_limits_t> limits;  // of a motor: the newest
  std::optional<device_info_t> info;
  AlarmView alarms;
  std::vector<trip_log_t> trips;  // each once, the last received at the end
  SequenceCount readings;         // POSITION or MOTOR messages
  std::int64_t valid_readings = 0;
  double reading_hz = 0;              // received, over the last full second
  MonoNs reading_at = 0;              // receipt of the newest
  std::optional<MonoNs> valid_at;     // of the newest valid one
  std::optional<std::size_t> on_bus;  // its bus's place in MachineView::buses()
  MonoNs info_at = 0;                 // receipt of `info`
  MonoNs limits_at = 0;               // receipt of `limits`
  bool was_online = false;

  // Returns the state that the driver reports once per second. If it was not received for kStaleAfter, the state follows
  // from the readings: ONLINE while valid readings arrive (DEGRADED if that was the last state), else the last state.
  // Returns nothing if no readings arrive either.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;  // device_info_t STATE_*
  [[nodiscard]] bool Online(MonoNs now) const { return State(now) == device_info_t::STATE_ONLINE; }
  // Returns the turns of the shaft after direction and datum; NaN before the first valid position.
  [[nodiscard]] double Turns() const;
  [[nodiscard]] double SpeedRpm() const;  // NaN when unknown
  // Returns true if its DEVICE was received, and also a reading if it is a monitor that answers.
  [[nodiscard]] bool Heard() const;
};

struct BusView {
  std::string name;
  bool listed = true;
  std::optional<bus_health_t> health;
  std::optional<exchange_times_t> times;  // since the driver started
  MonoNs health_at = 0;
  MonoNs times_at = 0;
  std::optional<MonoNs> valid_at;  // receipt of the newest valid reading of one of its devices

  // Returns bus_health_t STATE_*, reported once per second. Without that message, UP while valid readings arrive.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;
  // Returns the newest BUS message, or null if none was received in the last kStaleAfter.
  [[nodiscard]] const bus_health_t* FreshHealth(MonoNs now) const;
  [[nodiscard]] bool Up(MonoNs now) const { return State(now) == bus_health_t::STATE_UP; }
};

}  // namespace axlecast
