#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/sequence_count.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// States are reported once per second. An older state is not used.
inline constexpr MonoNs kStaleAfter = 2500 * kMillisecond;

// The newest ALARM message of one sender, and the changes that led to it.
class AlarmView {
 public:
  static constexpr std::size_t kMaxChanges = 64;
  static constexpr std::size_t kMaxSeen = 100;  // anybody can publish names

  struct Change {
    std::int64_t unix_us = 0;  // of the message with the change
    bool appeared = false;     // false: gone
    alarm_entry_t entry;       // as last reported
  };

  // Takes a message. Returns true if the set of alarms or a state has changed.
  bool On(alarm_t message, MonoNs now);

  [[nodiscard]] bool received() const { return received_; }
  [[nodiscard]] bool Fresh(MonoNs now) const { return received_ && now - at_ <= kStaleAfter; }
  [[nodiscard]] const std::vector<alarm_entry_t>& entries() const { return entries_; }  // worst first
  [[nodiscard]] std::size_t total() const { return total_; }  // also those that did not fit into the message
  [[nodiscard]] const std::deque<Change>& changes() const { return changes_; }  // the newest, oldest first
  [[nodiscard]] const std::set<std::string>& seen() const { return seen_; }     // names, since the start

 private:
  void Keep(std::int64_t unix_us, bool appeared, const alarm_entry_t& entry);

  std::vector<alarm_entry_t> entries_;
  std::size_t total_ = 0;
  std::deque<Change> changes_;
  std::set<std::string> seen_;
  MonoNs at_ = 0;
  bool received_ = false;
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
  [[nodiscard]] std::string StateText(MonoNs now) const;             // a word; SILENT without a state
  [[nodiscard]] bool Online(MonoNs now) const { return State(now) == device_info_t::STATE_ONLINE; }
  // Returns the turns of the shaft after direction and datum; NaN before the first valid position.
  [[nodiscard]] double Turns() const;
  [[nodiscard]] double SpeedRpm() const;  // NaN when unknown
  // Returns true if its DEVICE was received, and also a reading if it is a monitor that answers.
  [[nodiscard]] bool Received() const;
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
  [[nodiscard]] std::string StateText(MonoNs now) const;  // a word; SILENT without a state
  // Returns the newest BUS message, or null if none was received in the last kStaleAfter.
  [[nodiscard]] const bus_health_t* FreshHealth(MonoNs now) const;
  [[nodiscard]] bool Up(MonoNs now) const { return State(now) == bus_health_t::STATE_UP; }
};

// What a host knows about the time base.
struct HostView {
  std::string name;
  time_quality_t quality;  // the newest
  MonoNs at = 0;           // receipt of `quality`

  // Returns time_quality_t STATE_*; nothing if it is too old.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;
  // Returns true if the host claims an interval of the time base now.
  [[nodiscard]] bool Claims(MonoNs now) const { return State(now) && quality.half_width_ns >= 0; }
};

// The part of the machine that a message has updated.
struct MonitorUpdate {
  enum class Kind : std::uint8_t {
    kNothing,  // the message was malformed or of no part of the machine
    kPosition,
    kMotor,
    kMotorLimits,
    kDevice,
    kDeviceAlarms,
    kTrip,
    kBus,
    kExchangeTimes,
    kBridgeAlarms,
    kHostTime,
    kRecorder,  // this and the following: only from Monitor
    kRecorderAlarms,
    kCommand,
  };
  Kind kind = Kind::kNothing;
  std::size_t index = 0;  // in devices(), buses(), hosts() or recorders(); of a command in commands().newest()
  bool changed = false;   // a new state, alarm, trip or outcome
};

// Finds a name in a map of std::string without a copy of it.
struct NameHashing {
  using is_transparent = void;
  std::size_t operator()(std::string_view name) const { return std::hash<std::string_view>()(name); }
};

// How devices and buses are treated that are not in the machine file.
enum class Unlisted : std::uint8_t { kIgnored, kShown };

// The state of a machine from its messages: first the devices and buses of its file, in the order of the file, then
// unlisted ones in the order of reception. Does no I/O. Its memory is bounded whatever is sent.
class MachineView {
 public:
  static constexpr std::size_t kMaxUnlistedDevices = 256;  // without a machine file
  static constexpr std::size_t kMaxUnlistedBuses = 32;
  static constexpr std::size_t kMaxUnlisted = 16;  // of each, if a machine file lists devices
  static constexpr std::size_t kMaxHosts = 32;

  explicit MachineView(const MachineConfig& machine, Unlisted unlisted = Unlisted::kIgnored);

  MonitorUpdate OnMessage(std::string_view channel, Bytes message, MonoNs now);
  // Updates the rates. Call it a few times per second.
  void Tick(MonoNs now);
  // Sets how many messages this process has received and lost.
  void OnReception(const ReceptionCounts& counts) { reception_ = counts; }
  // Sets how to lose fewer messages: the port's warning(), or empty.
  void SetReceptionRemedy(std::string remedy) { reception_remedy_ = std::move(remedy); }

  [[nodiscard]] const std::string& machine() const { return machine_; }
  [[nodiscard]] bool allows_unsigned() const { return allows_unsigned_; }  // unsigned commands
  [[nodiscard]] const std::vector<DeviceView>& devices() const { return devices_; }
  [[nodiscard]] const std::vector<BusView>& buses() const { return buses_; }
  [[nodiscard]] const AlarmView& bridge() const { return bridge_; }    // ALARM/bridge, published while it serves
  [[nodiscard]] const AlarmView& broker() const { return broker_; }    // ALARM/mqtt/<machine>
  [[nodiscard]] const AlarmView& shipper() const { return shipper_; }  // ALARM/ship/<machine>
  [[nodiscard]] const std::vector<HostConfig>& placement() const {
    return placement_;
  }  // `hosts` of the machine file
  [[nodiscard]] const std::string& time_root() const {
    return time_root_;
  }  // of the machine file; empty: no time base
  [[nodiscard]] const std::vector<HostView>& hosts() const { return hosts_; }  // that published TIME
  [[nodiscard]] std::size_t online(MonoNs now) const;
  [[nodiscard]] bool AllOnline(MonoNs now) const;  // every device ONLINE, every bus UP
  [[nodiscard]] bool AllReceived() const;          // every device, and BUS of every bus
  [[nodiscard]] bool NothingReceived() const;      // no device and no bus
  // Both return null for an unknown name. Their cost does not grow with the number of devices.
  [[nodiscard]] const DeviceView* FindDevice(std::string_view name) const;
  [[nodiscard]] const BusView* FindBus(std::string_view name) const;
  // Increases when a device or bus is added, and when more becomes known of one that the machine file does not list.
  [[nodiscard]] std::uint64_t layout() const { return layout_; }
  [[nodiscard]] const ReceptionCounts& reception() const { return reception_; }
  // Formats one line about lost messages, the cause and the fix. The line is empty without a loss.
  [[nodiscard]] std::string ReceptionLoss() const { return ReceptionText(reception_, reception_remedy_); }
  // Number of messages of unlisted devices and buses beyond the maximum number.
  [[nodiscard]] std::int64_t turned_away() const { return turned_away_; }

 private:
  using Index = std::unordered_map<std::string, std::size_t, NameHashing, std::equal_to<>>;  // place by name

  // Returns the view of this name. Adds an unlisted view if fewer than `maximum` exist.
  template <typename View>
  View* FindOrAdd(std::vector<View>& views, Index& index, std::size_t listed, std::size_t maximum,
                  std::string_view name);
  void FollowReading(DeviceView& device, MonoNs now);
  MonitorUpdate OnBus(std::string_view kind, std::string_view name, Bytes message, MonoNs now);
  MonitorUpdate OnHostTime(std::string_view name, Bytes message, MonoNs now);
  MonitorUpdate OnDevice(std::string_view kind, std::string_view name, Bytes message, MonoNs now);

  std::string machine_;
  bool allows_unsigned_;
  Unlisted unlisted_;
  std::size_t listed_devices_ = 0;
  std::size_t listed_buses_ = 0;
  std::vector<DeviceView> devices_;
  std::vector<BusView> buses_;
  Index device_index_;
  Index bus_index_;
  std::uint64_t layout_ = 0;
  std::vector<HostConfig> placement_;
  std::string time_root_;
  std::vector<HostView> hosts_;
  AlarmView bridge_;
  std::int64_t turned_away_ = 0;
  ReceptionCounts reception_;
  std::string reception_remedy_;
  AlarmView broker_;
  AlarmView shipper_;
  MonoNs window_start_ = 0;
  std::vector<std::int64_t> window_received_;  // readings of each device when the window began
};

// Returns the reasons why the machine is not good at `now`; empty if it is good. This is the definition of "good" for texts
// and exit codes (docs/cli.md, "Good"):
// - every listed device is ONLINE, and every listed bus is UP,
// - the bridge reports no alarm of severity ERROR or worse,
// - the connection to the MQTT broker reports no alarm,
// - if the machine has a time base, its root and every other host that publishes TIME claim an interval.
[[nodiscard]] std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now);

// Returns the part of MachineFaults that is about no single device or bus: hosts, bridge, broker and time base.
[[nodiscard]] std::vector<std::string> CommonFaults(const MachineView& machine, MonoNs now);

// Returns true if the host runs buses and none of them has a state.
[[nodiscard]] bool IsSilent(const HostConfig& host, const MachineView& machine, MonoNs now);

}  // namespace axlecast
