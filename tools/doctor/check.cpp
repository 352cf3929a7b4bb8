#include "tools/doctor/check.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"
#include "tools/doctor/checks.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr Severity kError = Severity::kError;
constexpr Severity kWarning = Severity::kWarning;
constexpr Severity kAdvice = Severity::kAdvice;

constexpr auto kChecks = std::to_array<Check>({
    {"multicast_route", kError, "the host has a route to LCM's multicast groups",
     "No process of the machine starts: LCM cannot send.", &CheckMulticastRoute},
    {"loopback_multicast", kError, "the loopback interface is up and has its MULTICAST flag",
     "Messages within this host do not arrive, or only at some programs.", &CheckLoopbackMulticast},
    {"multicast_interface", kWarning, "messages with ttl=0 use lo, others use the network",
     "With ttl=0 on a network interface, all messages stop when its cable is unplugged. With ttl above 0 on lo, no "
     "other host receives messages.",
     &CheckMulticastInterface},
    {"multicast_silent", kError, "a datagram to LCM's groups comes back",
     "The processes of the machine do not receive each other's messages.", &CheckMulticastSilent},
    {"firewall", kAdvice, "no firewall may drop datagrams to LCM's ports (needs root)",
     "If a rule drops the datagrams, they are lost in the kernel without an error.", &CheckFirewall},
    {"receive_buffer_max", kWarning, "net.core.rmem_max allows the requested receive buffers",
     "If a receiver is delayed, the kernel drops messages. The recorder counts them; other programs see gaps.",
     &CheckReceiveBufferMax},
    {"receive_buffer_default", kWarning, "net.core.rmem_default has room for 0.1 s of the machine's messages",
     "A process that is delayed for longer on a busy host loses messages.", &CheckReceiveBufferDefault},
    {"lcm_library", kAdvice, "this host has no liblcm that forged datagrams can break",
     "axlecast's own programs do not receive through it. Other programs (lcm-logger, your own) can be crashed by "
     "any host whose datagrams reach their port, also with ttl=0.",
     &CheckLcmLibrary},
    {"other_machine", kWarning, "no other machine uses the command port",
     "Every process receives the messages of both machines. Equal names are mixed up, and each machine raises "
     "alarms about the other.",
     &CheckOtherMachine},
    {"duplicate_driver", kError, "each bus has one driver",
     "Two drivers disturb each other on the line. The alarm duplicate_driver is raised.", &CheckDuplicateDriver},
    {"machine_faults", kError, "if the machine runs, it is good by the rules of status and up",
     "Positions or commands of the named part are missing or unreliable.", &CheckMachineFaults},
    {"port_missing", kError, "every port in the machine file exists", "The bus stays DOWN and its devices OFFLINE.",
     &CheckPortMissing},
    {"port_permission", kError, "this user may use every port (as root: a unit without privileges)",
     "The driver cannot open the line. The bus stays DOWN.", &CheckPortPermission},
    {"port_held", kError, "no other process has a port open",
     "The driver cannot lock the line, or each process receives only a part of the bytes.", &CheckPortHeld},
    {"port_name", kAdvice, "ports have persistent names",
     "After reconnecting an adapter, the name may belong to another bus.", &CheckPortName},
    {"port_prober", kWarning, "no service probes the USB adapters (ModemManager, brltty)",
     "The service sends modem commands to the devices and occupies the port for half a minute after it is plugged "
     "in.",
     &CheckPortProber},
    {"usb_latency", kWarning, "USB adapters deliver bytes after 1 ms",
     "Each exchange waits for the adapter's timer. The driver requests 1 ms when it opens the port; some kernels "
     "refuse.",
     &CheckUsbLatency},
    {"adapter_rate", kError, "the adapters' chips support the baud rates in the machine file",
     "Replies are damaged or missing.", &CheckAdapterRate},
    {"spi_buffer", kError, "spidev accepts the longest transfer", "Readings fail with \"message too long\".",
     &CheckSpiBuffer},
    {"can_missing", kError, "every CAN interface in the machine file exists",
     "The bus stays DOWN and its devices OFFLINE.", &CheckCanMissing},
    {"can_down", kError, "every CAN interface is up", "The bus stays DOWN and its devices OFFLINE.", &CheckCanDown},
    {"can_bitrate", kError, "CAN interfaces have the bit rate of the machine file",
     "The driver refuses the bus, because a wrong bit rate disturbs all nodes.", &CheckCanBitrate},
    {"can_mode", kError, "CAN interfaces send, acknowledge and receive",
     "Commands do not reach the nodes, or count as acknowledged without any node.", &CheckCanMode},
    {"can_restart", kWarning, "CAN controllers restart after a bus-off",
     "After one short circuit, the bus is off until an operator restarts it with ip link.", &CheckCanRestart},
    {"can_state", kError, "CAN controllers detect no errors on the bus",
     "Frames are lost, late, or no longer sent.", &CheckCanState},
    {"can_queue", kWarning, "CAN interfaces can queue two commands for each node",
     "Commands to many nodes at once are refused (ENOBUFS) and retried later.", &CheckCanQueue},
    {"realtime_priority", kWarning, "realtime.priority of the machine file is allowed",
     "The driver runs at normal priority. On a busy host, readings are late.", &CheckRealtimePriority},
    {"realtime_memory", kWarning, "realtime.lock_memory of the machine file is allowed",
     "The driver's memory may be swapped out. A reading then waits for the disk.", &CheckRealtimeMemory},
    {"realtime_cpu", kError, "the processors of realtime.cpu exist",
     "The driver runs on any processor, together with other programs.", &CheckRealtimeCpu},
    {"cpu_governor", kAdvice,
     "if a bus is polled at 1 kHz or has a priority, processors have a constant clock rate",
     "Waking up takes longer until the clock rate has risen. Slots are late.", &CheckCpuGovernor},
    {"clock_source", kAdvice, "if a bus is polled at 1 kHz or has a priority, the kernel has a fast clock source",
     "Reading the clock takes about 1 us instead of 30 ns.", &CheckClockSource},
    {"clock_sync", kWarning, "UNIX time is synchronised",
     "Timestamps in messages and logs drift, differ between hosts, and may step. Commands of other hosts expire.",
     &CheckClockSync},
    {"log_folder", kError, "the recorder can write into its folder", "Nothing is recorded.", &CheckLogFolder},
    {"log_space", kWarning, "the disk has space for the recorder's quota or keep at the machine's message rate",
     "The disk fills up before the oldest logs are deleted. Recording stops with the alarm disk_full.",
     &CheckLogSpace},
    {"log_file_system", kWarning, "logs are on a disk of this host",
     "In memory, logs are lost at a restart. On a network or FAT (4 GB per file), writing can stall or stop.",
     &CheckLogFileSystem},
    {"journal_folder", kError, "the bridge can write its journal",
     "The bridge does not start. No command is executed.", &CheckJournalFolder},
    {"journal_space", kError, "the journal's disk has 64 MB free",
     "If the journal is full, commands that change a device are refused.", &CheckJournalSpace},
    {"journal_file_system", kWarning, "the journal is on a disk of this host",
     "In memory, datums and outcomes are lost at a restart. On a network, file locks are not safe for SQLite.",
     &CheckJournalFileSystem},
    {"key_missing", kError, "the key files exist",
     "The process cannot sign. Its commands or outcomes are rejected.", &CheckKeyMissing},
    {"key_mode", kError, "the key files are not accessible to others",
     "The key is refused. Anybody who has read it can send commands until it is replaced.", &CheckKeyMode},
    {"key_owner", kError, "the machine's own keys belong to root or to its service",
     "The bridge and the drivers refuse the key, because its owner could read and change it.", &CheckKeyOwner},
    {"key_access", kError, "each process can read its own key and no other key",
     "A compromised process can sign as another process; or a process cannot sign.", &CheckKeyAccess},
    {"group_members", kWarning, "operators are in no group of a process and cannot open devices",
     "Interlocks, limits and the journal can be bypassed.", &CheckGroupMembers},
    {"key_permission", kWarning, "this user can read a key for commands",
     "Commands of this user are not signed and therefore rejected.", &CheckKeyPermission},
    {"config_mode", kError, "only authorised users can write the machine file",
     "Any user of this host can add a key and send commands.", &CheckConfigMode},
});

std::string CountedWord(std::ptrdiff_t count, const std::string& what, const std::string& plural) {
  return count == 0 ? "" : std::to_string(count) + ' ' + (count == 1 ? what : plural);
}

Json DiagnosisJson(const Diagnosis& diagnosis) {
  const Check& check = *diagnosis.check;
  Json json = {{"name", check.name},
               {"severity", SeverityName(check.severity)},
               {"found", diagnosis.symptom.found},
               {"effect", check.effect},
               {"mend", Json::array()},
               {"safe", diagnosis.symptom.safe}};
  for (const Fix& fix : diagnosis.symptom.fixes) json["mend"].push_back(LineOf(fix));
  return json;
}

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
                                const std::function<bool(const Check&)>& selected) {
  std::vector<Diagnosis> all;
  for (const Check& check : kChecks) {
    if (!selected(check)) continue;
    for (Symptom& symptom : check.run(machine, host)) all.push_back({&check, std::move(symptom)});
  }
  return all;
}

std::string DiagnosisText(const Diagnosis& diagnosis) {
  const Check& check = *diagnosis.check;
  std::string text = std::string(SeverityName(check.severity)) + ' ' + std::string(check.name) + ": " +
                     diagnosis.symptom.found + "\n  " + std::string(check.effect) + '\n';
  text += diagnosis.symptom.safe ? "  As root, or with --fix:\n" : "  As root:\n";
  for (const Fix& fix : diagnosis.symptom.fixes) text += "    " + LineOf(fix) + '\n';
  return text;
}

std::string CountText(const std::vector<Diagnosis>& diagnoses) {
  const auto count = [&](Severity severity) {
    return std::count_if(diagnoses.begin(), diagnoses.end(),
                         [severity](const Diagnosis& one) { return one.check->severity == severity; });
  };
  std::string text;
  for (const std::string& part : {CountedWord(count(Severity::kError), "error", "errors"),
                                  CountedWord(count(Severity::kWarning), "warning", "warnings"),
                                  CountedWord(count(Severity::kAdvice), "piece of advice", "pieces of advice")}) {
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  }
  return text.empty() ? "nothing found" : text;
}

Json DoctorJson(const std::string& file, const std::vector<Diagnosis>& diagnoses,
                const std::vector<std::string>& fixed) {
  Json json = {
      {"file", file.empty() ? Json() : Json(file)}, {"ok", AdviceAlone(diagnoses)}, {"findings", Json::array()}};
  for (const Diagnosis& diagnosis : diagnoses) json["findings"].push_back(DiagnosisJson(diagnosis));
  json["mended"] = fixed;
  return json;
}

std::string CheckListText() {
  std::string text;
  for (const Check& check : Checks()) {
    text += Left(check.name, 24) + Left(SeverityName(check.severity), 9) + std::string(check.looks_at) + '\n';
  }
  return text;
}

Json CheckListJson() {
  Json list = Json::array();
  for (const Check& check : Checks()) {
    list.push_back({{"name", check.name},
                    {"severity", SeverityName(check.severity)},
                    {"looks_at", check.looks_at},
                    {"effect", check.effect}});
  }
  return {{"checks", list}};
}

}  // namespace axlecast
