#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"
#include "tools/monitor/device_view.h"

namespace axlecast {

// What one message told.
struct Heard {
  enum class Kind : std::uint8_t {
    kNothing,  // of no part of the machine, or malformed
    kPosition,
    kMotor,
    kMotorLimits,
    kDevice,
    kDeviceAlarms,
    kTrip,
    kBus,
    kExchangeTimes,
    kBridgeAlarms,
    kRecorder,  // the rest by Monitor alone
    kRecorderAlarms,
    kCommand,
  };
  Kind kind = Kind::kNothing;
  std::size_t index = 0;  // in devices(), buses() or recorders(); of a command in commands().newest()
  bool news = false;      // false: a state, an alarm, a trip or an outcome that was known before
};

// Devices and buses that are heard but not in the machine's file.
enum class Unlisted : std::uint8_t { kIgnored, kShown };

// The machine as its messages show it: the devices and buses of its file, in the file's order, then those that are only
// heard, in the order in which they came. Pure: fed with messages and instants. What it holds is bounded whatever is sent.
class MachineView {
 public:
  static constexpr std::size_t kMaxUnlistedDevices = 256;  // without a file that lists any: all of a log
  static constexpr std::size_t kMaxUnlistedBuses = 32;
  static constexpr std::size_t kMaxUnlisted = 16;  // of each, beside those of a file

  explicit MachineView(const MachineConfig& machine, Unlisted unlisted = Unlisted::kIgnored);

  Heard OnMessage(std::string_view channel, Bytes message, MonoNs now);
  // At least a few times a second: closes the windows of the rates.
  void Tick(MonoNs now);
  // What the process that feeds it received of LCM, and lost.
  void OnReception(const ReceptionCounts& counts) { reception_ = counts; }
  // What would make that process lose less: a port's warning(), or empty.
  void SetReceptionRemedy(std::string remedy) { reception_remedy_ = std::move(remedy); }

  [[nodiscard]] const std::string& machine() const { return machine_; }
  [[nodiscard]] bool allows_unsigned() const { return allows_unsigned_; }  // commands of anybody
  [[nodiscard]] const std::vector<DeviceView>& devices() const { return devices_; }
  [[nodiscard]] const std::vector<BusView>& buses() const { return buses_; }
  [[nodiscard]] const AlarmView& bridge() const { return bridge_; }  // while it serves, it says so in ALARM/bridge
  [[nodiscard]] const AlarmView& broker() const { return broker_; }  // ALARM/mqtt/<machine>
  [[nodiscard]] std::size_t online(MonoNs now) const;
  [[nodiscard]] bool AllOnline(MonoNs now) const;  // every device ONLINE, every bus UP
  [[nodiscard]] bool AllHeard() const;             // every device, and BUS of all
  [[nodiscard]] bool NoneHeard() const;            // neither of any came
  [[nodiscard]] const DeviceView* FindDevice(std::string_view name) const;
  [[nodiscard]] const ReceptionCounts& reception() const { return reception_; }
  // One line of what was lost, why, and what mends it; empty when nothing was.
  [[nodiscard]] std::string ReceptionLoss() const { return ReceptionText(reception_, reception_remedy_); }
  // Messages of devices and buses that are not in the file and found no room among those that are shown.
  [[nodiscard]] std::int64_t turned_away() const { return turned_away_; }

 private:
  DeviceView* DeviceOf(std::string_view name);
  BusView* BusOf(std::string_view name);
  [[nodiscard]] std::size_t RoomFor(std::size_t maximum) const;
  void FollowReading(DeviceView& device, MonoNs now);
  Heard OnBus(std::string_view kind, std::string_view name, Bytes message, MonoNs now);
  Heard OnDevice(std::string_view kind, std::string_view name, Bytes message, MonoNs now);

  std::string machine_;
  bool allows_unsigned_;
  Unlisted unlisted_;
  std::size_t listed_devices_ = 0;
  std::size_t listed_buses_ = 0;
  std::vector<DeviceView> devices_;
  std::vector<BusView> buses_;
  AlarmView bridge_;
  std::int64_t turned_away_ = 0;
  ReceptionCounts reception_;
  std::string reception_remedy_;
  AlarmView broker_;
  MonoNs window_start_ = 0;
  std::vector<std::int64_t> window_received_;  // readings of each device when the window began
};

// Why the machine is not good at `now`, one sentence each; empty when it is. The one definition of "good", for people
// and exit codes (docs/cli.md, "Good"): every device is ONLINE, every bus UP, and neither a bridge that serves nor the
// bridge to a broker reports an alarm of severity ERROR or worse, or that its broker is away.
[[nodiscard]] std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now);

}  // namespace axlecast
