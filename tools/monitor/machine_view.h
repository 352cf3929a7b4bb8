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
    kRecorder,  // this and the following: only from Monitor
    kRecorderAlarms,
    kCommand,
  };
  Kind kind = Kind::kNothing;
  std::size_t index = 0;  // in devices(), buses() or recorders(); of a command in commands().newest()
  bool changed = false;   // a new state, alarm, trip or outcome
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
  [[nodiscard]] const AlarmView& bridge() const { return bridge_; }  // ALARM/bridge, published while it serves
  [[nodiscard]] const AlarmView& broker() const { return broker_; }  // ALARM/mqtt/<machine>
  [[nodiscard]] std::size_t online(MonoNs now) const;
  [[nodiscard]] bool AllOnline(MonoNs now) const;  // every device ONLINE, every bus UP
  [[nodiscard]] bool AllHeard() const;             // every device, and BUS of every bus
  [[nodiscard]] bool NoneHeard() const;            // no device and no bus
  [[nodiscard]] const DeviceView* FindDevice(std::string_view name) const;
  [[nodiscard]] const ReceptionCounts& reception() const { return reception_; }
  // Returns one line about lost messages, the cause and the fix; empty if no message was lost.
  [[nodiscard]] std::string ReceptionLoss() const { return ReceptionText(reception_, reception_remedy_); }
  // Number of messages of unlisted devices and buses beyond the maximum number.
  [[nodiscard]] std::int64_t turned_away() const { return turned_away_; }

 private:
  DeviceView* DeviceOf(std::string_view name);
  BusView* BusOf(std::string_view name);
  [[nodiscard]] std::size_t RoomFor(std::size_t maximum) const;
  void FollowReading(DeviceView& device, MonoNs now);
  MonitorUpdate OnBus(std::string_view kind, std::string_view name, Bytes message, MonoNs now);
  MonitorUpdate OnDevice(std::string_view kind, std::string_view name, Bytes message, MonoNs now);

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

// Returns the reasons why the machine is not good at `now`; empty if it is good. This is the definition of "good" for texts
// and exit codes (docs/cli.md, "Good"):
// - every listed device is ONLINE, and every listed bus is UP,
// - the bridge reports no alarm of severity ERROR or worse,
// - the connection to the MQTT broker reports no alarm.
[[nodiscard]] std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now);

}  // namespace axlecast
