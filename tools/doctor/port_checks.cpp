#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/base/inline_bytes.h"
#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr const char* kRulesFile = "/etc/udev/rules.d/99-axlecast.rules";
constexpr std::int64_t kShortLatency = 1;  // ms

// The properties of a kind of port.
struct PortKind {
  const char* what;
  const char* key;    // in the machine file
  const char* group;  // that may use such devices on Debian, or by `rule`
  const char* list;   // command that lists the devices
  const char* rule;   // of udev, which gives the devices to the group
};

const PortKind& KindOf(const PortUse& use) {
  static constexpr std::array<PortKind, 3> kKinds = {{
      {"serial port", "link.port", "dialout", "ls -l /dev/serial/by-id/ /dev/ttyS*",
       R"(SUBSYSTEM=="tty", KERNEL=="ttyUSB*|ttyACM*|ttyS*", GROUP="dialout", MODE="0660")"},
      {"SPI device", "link.spidev", "spi", "ls -l /dev/spidev*",
       R"(SUBSYSTEM=="spidev", GROUP="spi", MODE="0660")"},
      {"GPIO chip", "lines.*.chip", "gpio", "gpiodetect", R"(SUBSYSTEM=="gpio", GROUP="gpio", MODE="0660")"},
  }};
  return kKinds[static_cast<std::size_t>(use.kind)];
}

std::string Name(const PortUse& use) { return "bus " + use.bus + ": the " + KindOf(use).what + ' ' + use.path; }

// Calls look(use, facts, symptoms) for each port of the machine that has facts.
template <typename Look>
Symptoms ForEachPort(const MachineConfig& machine, const HostFacts& host, Look look) {
  Symptoms symptoms;
  for (const PortUse& use : PortsOf(machine)) {
    const auto facts = host.ports.find(use.path);
    if (facts != host.ports.end()) look(use, facts->second, symptoms);
  }
  return symptoms;
}

// A check of each port alone.
template <auto Look>
Symptoms EachPort(const MachineConfig& machine, const HostFacts& host) {
  return ForEachPort(machine, host, Look);
}

bool IsThere(const PortFacts& port) { return port.file.kind == HostFile::Kind::kCharacter; }

void LookWhetherMissing(const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
  if (IsThere(port)) return;
  const PortKind& kind = KindOf(use);
  Symptom symptom{};
  if (port.file.error != 0 && port.file.error != ENOENT) {
    symptom.found = Name(use) + " cannot be examined: " + std::strerror(port.file.error);
  } else {
    symptom.found = Name(use) + (port.file.error == 0 ? " is not a device" : " does not exist");
  }
  symptom.fixes.push_back(Manual(std::string(kind.list) + "    # lists the devices; then correct " + kind.key +
                                 " in the machine file"));
  if (use.kind == PortUse::Kind::kSpi) symptom.fixes.push_back(Run({"modprobe", "spidev"}));
  symptoms.push_back(std::move(symptom));
}

// Drivers run without privileges and cannot open what only root can open.
bool OthersMayUse(const HostFile& file) {
  const bool by_group = file.gid != 0 && (file.mode & 060) == 060;
  return by_group || (file.mode & 06) == 06;
}

Symptom PermissionSymptom(const PortUse& use, const HostFile& file) {
  const PortKind& kind = KindOf(use);
  Symptom symptom{.found =
                      Name(use) + " belongs to " + file.owner + ':' + file.group + " with mode " + ModeText(file)};
  if (!OthersMayUse(file)) {
    symptom.fixes = {Run({"groupadd", "--force", "--system", kind.group}), Append(kRulesFile, kind.rule),
                     Run({"udevadm", "control", "--reload"}), Run({"udevadm", "trigger", "--action=add"})};
  }
  symptom.fixes.push_back(Manual(std::string("usermod -aG ") +
                                 (OthersMayUse(file) ? file.group.c_str() : kind.group) +
                                 " USER    # then log in again; for a systemd unit: SupplementaryGroups="));
  return symptom;
}

// Uses the groups of axlecast-driver@.service, not the rights of this user.
bool DriversMayUse(const HostFile& file) {
  const bool by_group = (file.group == kDriversAccount || file.group == "dialout") && (file.mode & 060) == 060;
  return by_group || file.owner == kDriversAccount || (file.mode & 06) == 06;
}

Symptom DriversSymptom(const PortUse& use, const HostFile& file) {
  std::string rule = KindOf(use).rule;
  if (use.kind != PortUse::Kind::kSerial) {  // serial ports belong to dialout, a group of the drivers
    const std::string own = KindOf(use).group;
    rule.replace(rule.find(own, rule.find("GROUP=")), own.size(), kDriversAccount);
  }
  return {.found = Name(use) + " belongs to " + file.owner + ':' + file.group + " with mode " + ModeText(file) +
                   ": the drivers (group " + kDriversAccount + ") cannot open it",
          .fixes = {Append(kRulesFile, rule), Run({"udevadm", "control", "--reload"}),
                    Run({"udevadm", "trigger", "--action=add"})}};
}

bool IsOwnDriver(const HostProcess& process, const std::string& bus) {
  if (process.words.empty() || process.words[0].find("axlecast-") == std::string::npos) return false;
  const auto option = std::ranges::find(process.words, "--bus");
  return option != process.words.end() && option + 1 != process.words.end() && *(option + 1) == bus;
}

void LookForHolders(const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
  if (use.kind == PortUse::Kind::kGpio)
    return;  // several processes may open a chip; gpioinfo shows who uses a line
  for (const HostProcess& holder : port.holders) {
    if (IsOwnDriver(holder, use.bus)) continue;
    const std::string id = std::to_string(holder.id);
    symptoms.push_back({.found = Name(use) + " is open in process " + id + " (" + Printable(holder.name) + ')',
                        .fixes = {Manual("ps -fp " + id + "    # shows the process; to stop it: kill " + id)}});
  }
}

void LookAtName(const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
  const bool changes = use.path.starts_with("/dev/ttyUSB") || use.path.starts_with("/dev/ttyACM");
  if (!changes || port.lasting_name.empty()) return;
  symptoms.push_back({.found = Name(use) + " has a name that depends on the order of plugging in",
                      .fixes = {Manual("in the machine file: port: " + port.lasting_name)}});
}

bool IsProber(const HostProcess& process) { return process.name == "ModemManager" || process.name == "brltty"; }

std::string HexId(std::uint16_t number) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04x", unsigned{number});
  return text.data();
}

Symptoms CheckPortPermission(const MachineConfig& machine, const HostFacts& host) {
  const bool by_account = RunsUnderAccounts(machine, host);
  return ForEachPort(machine, host, [&](const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
    const HostFile& file = port.file;
    if (!IsThere(port)) return;
    if (by_account) {
      if (!DriversMayUse(file)) symptoms.push_back(DriversSymptom(use, file));
      return;
    }
    const bool usable = host.IsRoot() ? OthersMayUse(file) : file.readable && file.writable;
    if (!usable) symptoms.push_back(PermissionSymptom(use, file));
  });
}

Symptoms CheckPortProber(const MachineConfig& machine, const HostFacts& host) {
  const auto prober = std::ranges::find_if(host.processes, &IsProber);
  if (prober == host.processes.end()) return {};
  return ForEachPort(machine, host, [&](const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
    if (!port.usb) return;
    const std::string usb =
        R"(ATTRS{idVendor}==")" + HexId(port.usb->vendor) + R"(", ATTRS{idProduct}==")" + HexId(port.usb->product);
    symptoms.push_back(
        {.found =
             prober->name + " runs and opens " + use.path + " of bus " + use.bus + " whenever it is plugged in",
         .fixes = {Append(kRulesFile, usb + R"(", ENV{ID_MM_DEVICE_IGNORE}="1")"),
                   Run({"udevadm", "control", "--reload"}), Run({"systemctl", "disable", "--now", prober->name})}});
  });
}

void LookAtLatency(const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
  if (!port.latency_ms || *port.latency_ms <= kShortLatency) return;
  symptoms.push_back(
      {.found = Name(use) + " has a latency timer of " + std::to_string(*port.latency_ms) + " ms: about " +
                std::to_string(1'000 / *port.latency_ms) + " exchanges per second",
       .fixes = {Write(port.latency_timer, "1"),
                 Append(kRulesFile,
                        R"(ACTION=="add", SUBSYSTEM=="usb-serial", DRIVER=="ftdi_sio", ATTR{latency_timer}="1")")},
       .safe = true});
}

void LookAtRate(const PortUse& use, const PortFacts& port, Symptoms& symptoms) {
  if (use.kind != PortUse::Kind::kSerial || !port.usb) return;
  const AdapterVerdict verdict = CheckAdapter(*port.usb, use.baud);
  if (verdict.fits) return;  // or unknown: the driver reports it at its start
  symptoms.push_back({.found = "bus " + use.bus + ": " + verdict.text,
                      .fixes = {Manual("plug in an adapter with an FT232H, FT2232H or FT4232H")}});
}

Symptoms CheckSpiBuffer(const MachineConfig& machine, const HostFacts& host) {
  const std::vector<PortUse> ports = PortsOf(machine);
  const bool used = std::ranges::any_of(ports, [](const PortUse& use) { return use.kind == PortUse::Kind::kSpi; });
  constexpr auto kNeeded = static_cast<std::int64_t>(kMaxFrame);
  if (!used || !host.spi_buffer || *host.spi_buffer >= kNeeded) return {};
  return {{.found = "spidev accepts transfers of at most " + std::to_string(*host.spi_buffer) + " bytes; up to " +
                    std::to_string(kNeeded) + " may be needed",
           .fixes = {Append("/etc/modprobe.d/axlecast.conf", "options spidev bufsiz=4096"),
                     Manual("reboot, or with all drivers stopped: modprobe -r spidev; modprobe spidev")}}};
}

constexpr auto kChecks = std::to_array<Check>({
    {"port_missing", Severity::kError, "every port in the machine file exists",
     "The bus stays DOWN and its devices OFFLINE.", &EachPort<&LookWhetherMissing>},
    {"port_permission", Severity::kError, "this user may use every port (as root: a unit without privileges)",
     "The driver cannot open the line. The bus stays DOWN.", &CheckPortPermission},
    {"port_held", Severity::kError, "no other process has a port open",
     "The driver cannot lock the line, or each process receives only a part of the bytes.",
     &EachPort<&LookForHolders>},
    {"port_name", Severity::kAdvice, "ports have persistent names",
     "After reconnecting an adapter, the name may belong to another bus.", &EachPort<&LookAtName>},
    {"port_prober", Severity::kWarning, "no service probes the USB adapters (ModemManager, brltty)",
     "The service sends modem commands to the devices and occupies the port for half a minute after it is plugged "
     "in.",
     &CheckPortProber},
    {"usb_latency", Severity::kWarning, "USB adapters deliver bytes after 1 ms",
     "Each exchange waits for the adapter's timer. The driver requests 1 ms when it opens the port; some kernels "
     "refuse.",
     &EachPort<&LookAtLatency>},
    {"adapter_rate", Severity::kError, "the adapters' chips support the baud rates in the machine file",
     "Replies are damaged or missing.", &EachPort<&LookAtRate>},
    {"spi_buffer", Severity::kError, "spidev accepts the longest transfer",
     "Readings fail with \"message too long\".", &CheckSpiBuffer},
});

}  // namespace

std::span<const Check> PortChecks() { return kChecks; }

}  // namespace axlecast
