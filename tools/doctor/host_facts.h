#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "drivers/hal/adapter.h"
#include "drivers/hal/can_netlink.h"
#include "platform/os/folder.h"
#include "tools/doctor/host/host_files.h"
#include "tools/doctor/host/host_network.h"
#include "tools/doctor/host/host_system.h"

namespace axlecast {

// Readings of a host, as far as a machine's file asks for them. Checks see nothing else.

// One LCM URL of the machine.
struct GroupFacts {
  MulticastRoute route;
  std::string silence;  // why a datagram to oneself did not come back; empty: it did, or was not sent
};

struct NetworkFacts {
  std::map<std::string, GroupFacts> groups;  // by URL
  LoopbackState loopback;
  std::string firewall;                                       // `nft --json list ruleset`; empty: cannot be read
  std::optional<std::int64_t> receive_max;                    // net.core.rmem_max
  std::optional<std::int64_t> receive_default;                // net.core.rmem_default
  std::vector<std::string> lcm_libraries;                     // files of liblcm
  std::vector<std::pair<std::string, std::int64_t>> drivers;  // heard on the command port: channel, boot id
  std::vector<std::string> machine_faults;                    // of the machine, where it runs: MachineFaults
};

// A serial port, SPI device or GPIO chip.
struct PortFacts {
  HostFile file;
  std::vector<HostProcess> holders;
  std::string lasting_name;  // of /dev/serial/by-id, or by-path; empty: none leads here
  std::optional<UsbAdapter> usb;
  std::string latency_timer;  // path, where the adapter has one
  std::optional<std::int64_t> latency_ms;
};

struct ProcessorFacts {
  std::string online;                                          // "0-3,6"; empty: not known
  std::vector<std::pair<std::string, std::string>> governors;  // path of the setting, its value
  std::string clock_source;                                    // tsc, hpet, ...
};

struct HostFacts {
  uid_t user = 0;  // of this process
  [[nodiscard]] bool IsRoot() const { return user == 0; }
  std::vector<HostProcess> processes;
  NetworkFacts network;
  std::map<std::string, PortFacts> ports;          // by path
  std::optional<std::int64_t> spi_buffer;          // bytes of one transfer that spidev takes
  std::map<std::string, CanInterfaceReply> can;    // by name
  std::map<std::string, std::int64_t> can_queues;  // frames that an interface queues at most, by name
  RealtimeLimits limits;
  ProcessorFacts processors;
  ClockSync clock;
  HostFolder logs;
  std::map<std::string, std::int64_t> log_bytes;           // on the disk already, by name of the log
  HostFolder journal;                                      // of its file
  std::map<std::string, HostFile> secrets;                 // files of keys, by path
  HostFile config;                                         // the machine's file
  bool config_shared = false;                              // others than its owner may write it
  std::map<std::string, std::vector<std::string>> groups;  // of /etc/group, with their members
};

// "0640"
[[nodiscard]] std::string ModeText(const HostFile& file);

// A port of a bus that is not simulated.
struct PortUse {
  enum class Kind : std::uint8_t { kSerial, kSpi, kGpio };

  Kind kind = Kind::kSerial;
  std::string bus;
  std::string path;
  std::int64_t baud = 0;  // kSerial
};
[[nodiscard]] std::vector<PortUse> PortsOf(const MachineConfig& machine);

// The drivers that report on the command port: channel and boot id. Anybody may invent both. Those of this machine are always
// among them.
class HeardDrivers {
 public:
  static constexpr std::size_t kMaxBoots = 8;     // of one bus; two are a finding
  static constexpr std::size_t kMaxOthers = 100;  // of buses that the machine does not have

  explicit HeardDrivers(const MachineConfig& machine) : machine_(machine) {}

  void On(const std::string& channel, std::int64_t boot_id);
  [[nodiscard]] std::vector<std::pair<std::string, std::int64_t>> All() const;

 private:
  const MachineConfig& machine_;
  std::map<std::string, std::set<std::int64_t>> ours_;  // boot ids by channel
  std::map<std::string, std::int64_t> others_;          // a boot id by channel
};

// Whether a driver that was heard is one of this machine, by the channel of its DRIVER_STATUS.
[[nodiscard]] bool IsDriverOf(const MachineConfig& machine, const std::string& channel);
// The bus of such a channel, without the prefix of whoever sent it.
[[nodiscard]] std::string BusOfChannel(const std::string& channel);

// CAN buses that are not simulated.
[[nodiscard]] std::vector<const BusConfig*> CanBusesOf(const MachineConfig& machine);

// The files that hold the machine's own keys, and those of who may command.
[[nodiscard]] std::vector<std::string> OwnKeyFiles(const MachineConfig& machine);
[[nodiscard]] std::vector<std::string> GrantKeyFiles(const MachineConfig& machine);

}  // namespace axlecast
