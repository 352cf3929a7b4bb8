#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "core/messages/machine_filter.h"
#include "core/time/chrony_packet.h"
#include "drivers/hal/adapter.h"
#include "drivers/hal/can_netlink.h"
#include "platform/net/network_interface.h"
#include "platform/os/folder.h"
#include "tools/doctor/host/host.h"

namespace axlecast {

// The facts of a host that a machine file needs. Checks use nothing else.

// One LCM URL of the machine.
struct GroupFacts {
  MulticastRoute route;           // with an interface in the URL only its name, if it exists
  std::string interface_problem;  // InterfaceWatch::problem, if the URL names an interface
  std::string silence;  // why no datagram to this host itself came back; empty: it came back, or none was sent
};

struct NetworkFacts {
  std::map<std::string, GroupFacts> groups;  // by URL
  std::vector<NetworkInterface> interfaces;
  LoopbackState loopback;
  std::string firewall;                                       // `nft --json list ruleset`; empty: cannot be read
  std::optional<std::int64_t> receive_max;                    // net.core.rmem_max
  std::optional<std::int64_t> receive_default;                // net.core.rmem_default
  std::vector<std::string> lcm_libraries;                     // files of liblcm
  std::vector<std::pair<std::string, std::int64_t>> drivers;  // received on the command port: channel, boot id
  std::vector<OtherMachine> machines = {};                    // that send on the same channels
  std::vector<std::string> machine_faults;                    // if the machine runs: MachineFaults
};

// A serial port, SPI device or GPIO chip.
struct PortFacts {
  HostFile file;
  std::vector<HostProcess> holders;
  std::string lasting_name;  // in /dev/serial/by-id or by-path; empty: none
  std::optional<UsbAdapter> usb;
  std::string latency_timer;  // path, if the adapter has one
  std::optional<std::int64_t> latency_ms;
};

struct ProcessorFacts {
  std::string online;                                          // "0-3,6"; empty: unknown
  std::vector<std::pair<std::string, std::string>> governors;  // path of the setting, its value
  std::string clock_source;                                    // tsc, hpet, ...
};

// What keeps UNIX time. The kernel knows only that a program does, and learns it from chronyd only with `rtcsync`.
struct ClockFacts {
  bool known = false;                    // the kernel has answered
  bool synchronised = false;             // KernelUtc::synchronised
  std::optional<ChronyTracking> chrony;  // chronyd has answered
  std::int64_t utc_ns = 0;               // UNIX time of its answer
};

struct ConfigFileFacts {
  HostFile file;
  bool shared = false;  // others than its owner may write it
};

struct HostFacts {
  uid_t user = 0;  // of this process
  [[nodiscard]] bool IsRoot() const { return user == 0; }
  std::vector<HostProcess> processes;
  NetworkFacts network;
  std::map<std::string, PortFacts> ports;          // by path
  std::optional<std::int64_t> spi_buffer;          // maximum bytes of one spidev transfer
  std::map<std::string, CanInterfaceReply> can;    // by name
  std::map<std::string, std::int64_t> can_queues;  // maximum number of queued frames, by name
  RealtimeLimits limits;
  ProcessorFacts processors;
  ClockFacts clock;
  HostFolder logs;
  std::map<std::string, std::int64_t> log_bytes;           // already on the disk, by name of the log
  HostFolder journal;                                      // of the journal file
  std::map<std::string, HostFile> secrets;                 // key files, by path
  std::vector<ConfigFileFacts> configs;                    // the machine file, and those that it includes
  std::map<std::string, std::vector<std::string>> groups;  // members of the groups in /etc/group
};

// Returns a text like "0640".
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

// Collects the drivers that report on the command port, with a bounded number of entries: anybody can send invented
// channels and boot ids. They never displace the drivers of this machine.
class ReceivedDrivers {
 public:
  static constexpr std::size_t kMaxBoots = 8;     // of one bus; two are a symptom
  static constexpr std::size_t kMaxOthers = 100;  // drivers of other machines

  explicit ReceivedDrivers(const MachineConfig& machine) : machine_(machine) {}

  void On(const std::string& channel, std::int64_t boot_id);
  [[nodiscard]] std::vector<std::pair<std::string, std::int64_t>> All() const;

 private:
  const MachineConfig& machine_;
  std::map<std::string, std::set<std::int64_t>> own_;  // boot ids by channel
  std::map<std::string, std::int64_t> others_;         // a boot id by channel
};

// Returns true if a channel is the DRIVER_STATUS of a driver of this machine.
[[nodiscard]] bool IsDriverOf(const MachineConfig& machine, const std::string& channel);
// Returns the bus of a DRIVER_STATUS channel, without any prefix.
[[nodiscard]] std::string BusOfChannel(const std::string& channel);

// Returns the CAN buses that are not simulated.
[[nodiscard]] std::vector<const BusConfig*> CanBusesOf(const MachineConfig& machine);

// Return the files of the machine's own keys, and of the keys of clients that may command.
[[nodiscard]] std::vector<std::string> OwnKeyFiles(const MachineConfig& machine);
[[nodiscard]] std::vector<std::string> GrantKeyFiles(const MachineConfig& machine);

// The accounts of the package: each process has its own account and reads only its own key (docs/install.md). On a host
// without these accounts, the checks of accounts find nothing.
inline constexpr const char* kDriversAccount = "axlecast-drivers";
// Returns true if the machine runs under these accounts: they exist, and the units read this machine file.
[[nodiscard]] bool RunsUnderAccounts(const MachineConfig& machine, const HostFacts& host);

struct ReadHostOptions {
  HostFiles files;
  MonoNs listen = 1'500 * kMillisecond;  // for drivers, which report once per second; 0: do not listen
  bool read_machine = true;              // also receive the machine's messages, if one of its drivers was received
};

// Reads the facts of this host that the checks need for this machine. Opens no port and sends only a datagram to itself.
// The machine's own files (keys, logs, journal) are read without the root folder of `files`.
[[nodiscard]] HostFacts ReadHost(const MachineConfig& machine, const ReadHostOptions& options);

}  // namespace axlecast
