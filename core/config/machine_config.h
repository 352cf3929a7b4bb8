#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/spelling.h"
#include "core/command/keys.h"
#include "core/config/service_config.h"
#include "core/config/ship_config.h"
#include "core/device/family.h"

namespace axlecast {

// The machine's file, read and checked. Documented key by key in docs/configuration.md.

struct LcmConfig {
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string command_url = "udpm://239.255.76.67:7668?ttl=0";
  std::string prefix;  // put before every channel name
};

struct LinkConfig {
  // /dev/serial/by-id/..., can0 or /dev/spidev0.0; of a simulated bus the pty or socket in the run directory
  std::string port;
  LineFormat line;            // kSerial, kModbus
  bool echo = false;          // the adapter receives its own transmission
  bool pty = false;           // the port may be a pseudo-terminal of another program
  std::int64_t bitrate = 0;   // kCan: bit/s that the interface must run at
  std::int64_t clock_hz = 0;  // kSpi: at most; 0: the family chooses
};

struct RealtimeConfig {
  int priority = 0;  // SCHED_FIFO 1..99; 0: normal scheduling
  int cpu = -1;      // -1: any
  bool lock_memory = false;
};

enum class TurnsMode : std::uint8_t {
  kSigned,    // the multi-turn counter is read as two's complement of its range
  kUnsigned,  // 0 .. range-1; passing its end is an alarm
  kModulo,    // passing its end continues to count; absolute modulo the range after a start
};

struct DeviceConfig {
  std::string name;
  std::string model;
  int direction = 1;           // +1 ccw positive, -1 cw positive (seen from the shaft end)
  std::int8_t unit = 1;        // position_t UNIT_*
  double per_turn = 1;         // value in unit of one output turn
  std::int64_t ratio_num = 1;  // output turns = shaft turns x num / den
  std::int64_t ratio_den = 1;
  double modulo = 0;  // in unit; 0 none
  TurnsMode turns = TurnsMode::kModulo;
  std::optional<std::int64_t> datum_counts;  // a fixed datum from the file
  double publish_hz = 1000;                  // at most
  bool block = false;                        // POSITION_BLOCK at full poll rate as well
  double speed_rpm = 0;                      // limits: 0 the model's
  double accel_rad_s2 = 0;
  bool permit_required = true;
  std::uint8_t alarm_stays_from = kNoSeverity;  // until acknowledged: alarm_entry_t SEVERITY_*
  std::int64_t config_hash = 0;
  int line = 0;                                    // in the file
  std::shared_ptr<const DeviceSettings> settings;  // the family's
};

struct BusConfig {
  std::string name;
  const Family* family = nullptr;
  LinkConfig link;
  bool simulate = false;
  bool capture = false;   // publish WIRE/<bus>
  double poll_hz = 1000;  // 0: as fast as the bus allows
  MonoNs phase = 0;       // of the poll slots, from CLOCK_MONOTONIC's zero
  MonoNs late = 0;        // maximum time between a request and its reply; 0: replies cannot be late
  RealtimeConfig realtime;
  std::shared_ptr<const FamilyBus> family_bus;  // the family's keys; null when it has none
  std::vector<DeviceConfig> devices;
};

// Returns the clock settings of the one device of an SPI bus.
[[nodiscard]] SpiSettings SpiOf(const BusConfig& bus);
// Returns the filters of all devices of a CAN bus.
[[nodiscard]] CanFilters CanFiltersOf(const BusConfig& bus);

// Returns the shortest time in which every device of the bus is read once.
[[nodiscard]] MonoNs RoundTime(const BusConfig& bus);

struct BridgeConfig {
  bool allow_unsigned = false;  // unsigned_commands: allow
  std::string journal;          // file; empty: journal.db in StateDirectory
  OwnKey bridge;                // signs orders and statuses; without it drivers obey unsigned ones where allowed
  OwnKey drivers;               // one for all drivers of the machine
  std::vector<KeyGrant> keys;

  [[nodiscard]] const KeyGrant* FindKey(std::int64_t id) const;
};

// Axes whose readings on one tick are published together as POSITION_SET/<name>: docs/ticks.md.
struct SetConfig {
  std::string name;
  std::vector<std::string> axes;
  MonoNs limit = 0;   // a wider hull of the sampling instants is not aligned
  MonoNs period = 0;  // of the ticks with a set: that of the axes' POSITION messages
};

// What runs on one host of a machine.
struct HostConfig {
  std::string name;
  std::vector<std::string> buses;  // the drivers of these
  bool bridge = false;
  bool recorder = false;
  bool mqtt = false;
  bool ship = false;
  bool sets = false;
};

// A file that was read, and its content.
struct ConfigSource {
  std::string file;
  std::string text;
};

struct MachineConfig {
  std::string file;
  std::string text;  // the file's content; with `include`, the whole document as one YAML text
  std::vector<ConfigSource>
      sources;  // with `include`: the file and those that it includes, in the order of reading
  std::string machine;
  LcmConfig lcm;
  std::vector<BusConfig> buses;
  BridgeConfig bridge;
  RecorderConfig recorder;
  WebConfig web;
  MqttConfig mqtt;
  ShipConfig ship;
  TimeConfig time;
  std::vector<SetConfig> sets;
  std::vector<HostConfig> hosts;  // empty: everything runs on one host
  bool runs_bridge = true;        // false only in a part of the machine: PartOn

  [[nodiscard]] const BusConfig* FindBus(std::string_view name) const;
  // The bus that holds the device, or null.
  [[nodiscard]] const BusConfig* BusOf(std::string_view device) const;
  [[nodiscard]] const DeviceConfig* FindDevice(std::string_view name) const;
};

// Returns the folder for the ptys and control sockets of simulated buses and for the locks of drivers:
// $AXLECAST_RUN_DIR, else $XDG_RUNTIME_DIR/axlecast, else /tmp/axlecast-<uid>; then /<machine>.
[[nodiscard]] std::string RunDirectory(const std::string& machine);

// Returns the folder for data that must outlive the bridge: $STATE_DIRECTORY (systemd.exec(5)), else
// $XDG_STATE_HOME/axlecast, else $HOME/.local/state/axlecast; then /<machine>.
[[nodiscard]] std::string StateDirectory(const std::string& machine);
// Returns the journal's file: the configured file, else journal.db in StateDirectory.
[[nodiscard]] std::string JournalFile(const MachineConfig& machine);

// Returns the folder of the recorder's logs: the configured folder, else $LOGS_DIRECTORY (systemd.exec(5)) and /<machine>, else log
// in StateDirectory.
[[nodiscard]] std::string LogDirectory(const MachineConfig& machine);

// Returns the value of one count in the unit of the axis, without `modulo`: per_turn x num / (den x counts per turn).
[[nodiscard]] double UnitPerCount(const DeviceConfig& device);

// Returns the POSITION or MOTOR messages per second of a device of the bus: at most publish_hz, and no more often than it is read.
[[nodiscard]] double MessageRate(const BusConfig& bus, const DeviceConfig& device);
// Returns the sum of all devices.
[[nodiscard]] double MessageRate(const MachineConfig& machine);

}  // namespace axlecast
