#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"
#include "tools/recorder/sequence_count.h"

namespace axlecast {

// What the messages so far say of one device.
struct DeviceView {
  std::string name;
  std::string bus;
  bool has_position = true;             // false: a monitor, whose readings are MOTOR
  std::optional<position_t> position;   // the newest
  std::optional<position_t> valid;      // the newest with FLAG_VALID
  std::optional<motor_health_t> motor;  // the newest
  std::optional<device_info_t> info;
  std::vector<alarm_entry_t> alarms;  // as the newest ALARM says
  int alarms_total = 0;               // with those that had no room in it
  std::set<std::string> alarms_seen;  // names, since the start
  SequenceCount readings;             // POSITION or MOTOR messages
  std::int64_t valid_readings = 0;
  double reading_hz = 0;  // received, over the last full second
  MonoNs reading_at = 0;  // receipt of the newest
  MonoNs info_at = 0;     // receipt of `info`
  MonoNs alarms_at = 0;   // receipt of `alarms`; 0 never
  bool was_online = false;

  // The driver tells the state once a second; nothing when it has been silent for longer than kStaleAfter.
  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;  // device_info_t STATE_*
  [[nodiscard]] bool Online(MonoNs now) const { return State(now) == device_info_t::STATE_ONLINE; }
  // Whole and part turns of the shaft after direction and datum; NaN before the first valid position.
  [[nodiscard]] double Turns() const;
  [[nodiscard]] double SpeedRpm() const;  // NaN when unknown
  // Its DEVICE came, and of a monitor that answers a reading too: monitors may be read every few seconds only.
  [[nodiscard]] bool Heard() const;
};

struct BusView {
  std::string name;
  std::optional<bus_health_t> health;
  MonoNs health_at = 0;

  [[nodiscard]] std::optional<std::int8_t> State(MonoNs now) const;  // bus_health_t STATE_*
  [[nodiscard]] bool Up(MonoNs now) const { return State(now) == bus_health_t::STATE_UP; }
};

// What the bridge says of itself, in ALARM/bridge.
struct BridgeView {
  std::vector<alarm_entry_t> alarms;
  MonoNs at = 0;  // receipt of the newest
  bool heard = false;

  [[nodiscard]] bool Serves(MonoNs now) const;
};

// Messages come once a second; a state older than this is no state.
inline constexpr MonoNs kStaleAfter = 2500 * kMillisecond;

// The machine as its messages show it: the devices and buses of its file, in the file's order. Pure: fed with
// messages and instants.
class MachineView {
 public:
  explicit MachineView(const MachineConfig& machine);

  void OnMessage(std::string_view channel, Bytes message, MonoNs now);
  // At least a few times a second: closes the windows of the rates.
  void Tick(MonoNs now);

  [[nodiscard]] const std::string& machine() const { return machine_; }
  [[nodiscard]] bool allows_unsigned() const { return allows_unsigned_; }  // commands of anybody
  [[nodiscard]] const std::vector<DeviceView>& devices() const { return devices_; }
  [[nodiscard]] const std::vector<BusView>& buses() const { return buses_; }
  [[nodiscard]] const BridgeView& bridge() const { return bridge_; }
  [[nodiscard]] std::size_t online(MonoNs now) const;
  [[nodiscard]] bool AllOnline(MonoNs now) const;  // every device ONLINE, every bus UP
  [[nodiscard]] bool AllHeard() const;             // every device, and BUS of all
  [[nodiscard]] bool NoneHeard() const;            // neither of any came
  [[nodiscard]] const DeviceView* FindDevice(std::string_view name) const;

 private:
  void OnBridge(Bytes message, MonoNs now);
  static void OnDevice(DeviceView& device, std::string_view kind, Bytes message, MonoNs now);

  std::string machine_;
  bool allows_unsigned_;
  std::vector<DeviceView> devices_;
  std::vector<BusView> buses_;
  BridgeView bridge_;
  MonoNs window_start_ = 0;
  std::vector<std::int64_t> window_received_;  // readings of each device when the window began
};

}  // namespace axlecast
