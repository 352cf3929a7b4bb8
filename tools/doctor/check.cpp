#include "tools/doctor/check.h"

#include <algorithm>
#include <array>

#include "tools/doctor/account_checks.h"
#include "tools/doctor/can_checks.h"
#include "tools/doctor/disk_checks.h"
#include "tools/doctor/key_checks.h"
#include "tools/doctor/network_checks.h"
#include "tools/doctor/port_checks.h"
#include "tools/doctor/time_checks.h"

namespace axlecast {
namespace {

constexpr Severity kError = Severity::kError;
constexpr Severity kWarning = Severity::kWarning;
constexpr Severity kAdvice = Severity::kAdvice;

constexpr auto kChecks = std::to_array<Check>({
    {"multicast_route", kError, "the host has a route to LCM's multicast groups",
     "No process of the machine starts: LCM cannot send.", &CheckMulticastRoute},
    {"loopback_multicast", kError, "the loopback interface is up and has its MULTICAST flag",
     "Messages within this host do not arrive, or only at some programs.", &CheckLoopbackMulticast},
    {"multicast_interface", kWarning, "messages for this host go by lo, those for others by the network",
     "With ttl=0 by the network, the machine falls silent when that cable is pulled; with ttl above 0 by lo, no "
     "other "
     "host hears it.",
     &CheckMulticastInterface},
    {"multicast_silent", kError, "a datagram to LCM's groups comes back",
     "The processes of the machine do not hear one another.", &CheckMulticastSilent},
    {"firewall", kError, "no rule of the firewall drops LCM's ports (needs root)",
     "Messages are lost in the kernel, and nobody is told.", &CheckFirewall},
    {"receive_buffer_max", kWarning, "net.core.rmem_max allows the receive buffers that are asked for",
     "Bursts are lost in the kernel when a reader is held up; the recorder counts them, others notice gaps.",
     &CheckReceiveBufferMax},
    {"receive_buffer_default", kWarning, "net.core.rmem_default has room for 0.1 s of the machine's messages",
     "A process that sleeps for longer on a busy host loses messages.", &CheckReceiveBufferDefault},
    {"lcm_library", kAdvice, "no program of this host can receive through a liblcm that forged datagrams break",
     "axlecast's own programs do not receive through it. Others of this host (lcm-logger, your own) can be ended "
     "by anybody "
     "whose datagrams reach their port, also with ttl=0.",
     &CheckLcmLibrary},
    {"other_machine", kWarning, "no other machine is heard on the command port",
     "Every process receives the messages of both, equal names are mixed up, and each raises the other's alarms.",
     &CheckOtherMachine},
    {"duplicate_driver", kError, "each bus has one driver",
     "Two drivers disturb each other on the line; the alarm duplicate_driver is raised.", &CheckDuplicateDriver},
    {"machine_faults", kError, "the machine, where it runs, is good as status and up judge it",
     "Positions or commands of what is named are missing, or not to be relied on.", &CheckMachineFaults},
    {"port_missing", kError, "every port of the file exists", "The bus stays DOWN and its devices OFFLINE.",
     &CheckPortMissing},
    {"port_permission", kError, "this user, or as root a unit without privileges, may use every port",
     "The driver cannot open the line: the bus stays DOWN.", &CheckPortPermission},
    {"port_held", kError, "no other process has a port open",
     "The driver cannot lock the line, or both get a part of its bytes.", &CheckPortHeld},
    {"port_name", kAdvice, "ports have names that stay", "After plugging in anew, the bus may be another one.",
     &CheckPortName},
    {"port_prober", kWarning, "no service probes the USB adapters (ModemManager, brltty)",
     "Commands for modems go to the devices, and the port is busy for half a minute after it was plugged in.",
     &CheckPortProber},
    {"usb_latency", kWarning, "USB adapters hand bytes over after 1 ms",
     "Each exchange waits for the adapter's timer. The driver asks for 1 ms when it opens the port; not every "
     "kernel "
     "lets it.",
     &CheckUsbLatency},
    {"adapter_rate", kError, "the adapters' chips make the file's baud rates",
     "Replies are damaged or do not come at all.", &CheckAdapterRate},
    {"spi_buffer", kError, "spidev takes the longest transfer", "Readings fail with: message too long.",
     &CheckSpiBuffer},
    {"can_missing", kError, "every CAN interface of the file exists", "The bus stays DOWN and its devices OFFLINE.",
     &CheckCanMissing},
    {"can_down", kError, "every CAN interface is up", "The bus stays DOWN and its devices OFFLINE.", &CheckCanDown},
    {"can_bitrate", kError, "CAN interfaces run at the file's bit rate",
     "The driver refuses the bus; at a wrong rate this host would disturb all of its nodes.", &CheckCanBitrate},
    {"can_mode", kError, "CAN interfaces send, acknowledge and hear others",
     "Orders do not reach the nodes, or count as received when they are not.", &CheckCanMode},
    {"can_restart", kWarning, "CAN controllers come back after a bus-off",
     "One short circuit, and the bus is off until somebody types ip link.", &CheckCanRestart},
    {"can_state", kError, "CAN controllers see no errors on the bus", "Frames are lost, late, or sent no more.",
     &CheckCanState},
    {"can_queue", kWarning, "CAN interfaces queue two orders for each node",
     "Orders to many nodes at once are refused (ENOBUFS) and tried again later.", &CheckCanQueue},
    {"realtime_priority", kWarning, "the file's realtime.priority is allowed",
     "The driver runs at normal priority: on a busy host readings come late.", &CheckRealtimePriority},
    {"realtime_memory", kWarning, "the file's realtime.lock_memory is allowed",
     "The driver's memory may be swapped out: a reading then waits for the disk.", &CheckRealtimeMemory},
    {"realtime_cpu", kError, "the processors of realtime.cpu are there",
     "The driver runs on any processor, beside everything else.", &CheckRealtimeCpu},
    {"cpu_governor", kAdvice, "where a bus is polled at 1 kHz or has a priority, processors keep their clock",
     "Waking up takes longer while the clock rises: late slots.", &CheckCpuGovernor},
    {"clock_source", kAdvice, "where a bus is polled at 1 kHz or has a priority, the kernel has a fast clock",
     "Each look at the clock takes about 1 us instead of 30 ns.", &CheckClockSource},
    {"clock_sync", kWarning, "UNIX time is kept in step",
     "Times in messages and logs drift, differ between hosts, and may step; commands of other hosts expire.",
     &CheckClockSync},
    {"log_folder", kError, "the recorder may write into its folder", "Nothing is recorded.", &CheckLogFolder},
    {"log_space", kWarning, "the disk has room for the recorder's quota or keep at the machine's rate",
     "The disk fills up before the oldest logs go: recording stops, with the alarm disk_full.", &CheckLogSpace},
    {"log_file_system", kWarning, "logs are on a disk of this host",
     "Memory forgets them at a restart; over a network, or in FAT with its 4 GB a file, writing can stall or end.",
     &CheckLogFileSystem},
    {"journal_folder", kError, "the bridge may write its journal",
     "The bridge does not start: no command is carried out.", &CheckJournalFolder},
    {"journal_space", kError, "the journal's disk has 64 MB free",
     "Commands that change a device are refused when the journal is full.", &CheckJournalSpace},
    {"journal_file_system", kWarning, "the journal is on a disk of this host",
     "Memory forgets datums and outcomes at a restart; a network's locks are not safe for SQLite.",
     &CheckJournalFileSystem},
    {"key_missing", kError, "the files of the keys exist",
     "Whoever signs with the key cannot: orders, outcomes or commands are not believed.", &CheckKeyMissing},
    {"key_mode", kError, "the files of the keys are closed to others",
     "The key is refused; and whoever has read it may command until another takes its place.", &CheckKeyMode},
    {"key_owner", kError, "the machine's own keys belong to root or its service",
     "The bridge and the drivers refuse the key: their owner could read and change it.", &CheckKeyOwner},
    {"key_access", kError, "each process can read its own key, and no other",
     "One process that is taken over can sign as another; or a process cannot sign at all.", &CheckKeyAccess},
    {"group_members", kWarning, "who commands is in no process's group, and can open no device",
     "Interlocks, limits and the journal can be passed by.", &CheckGroupMembers},
    {"key_permission", kWarning, "this user can read a key that may command",
     "Commands of this user are rejected: they are not signed.", &CheckKeyPermission},
    {"config_mode", kError, "not everybody may write the machine's file",
     "Any user of this host can add a key of his own, and command.", &CheckConfigMode},
});

}  // namespace

std::span<const Check> Checks() { return kChecks; }

const Check* FindCheck(std::string_view name) {
  const auto* const found =
      std::find_if(kChecks.begin(), kChecks.end(), [name](const Check& check) { return check.name == name; });
  return found == kChecks.end() ? nullptr : found;
}

bool AdviceAlone(const std::vector<Diagnosis>& diagnoses) {
  return std::all_of(diagnoses.begin(), diagnoses.end(),
                     [](const Diagnosis& one) { return one.check->severity == Severity::kAdvice; });
}

std::vector<Diagnosis> Diagnose(const MachineConfig& machine, const HostFacts& host,
                                const std::function<bool(const Check&)>& wanted) {
  std::vector<Diagnosis> all;
  for (const Check& check : kChecks) {
    if (!wanted(check)) continue;
    for (Symptom& finding : check.run(machine, host)) all.push_back({&check, std::move(finding)});
  }
  return all;
}

}  // namespace axlecast
