#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "core/config/machine_config.h"
#include "tools/log/channel_filter.h"

namespace axlecast {
namespace {

// Bytes in a log: of a POSITION event with header and channel, and of the state of a device or bus per second.
constexpr double kPositionBytes = 180;
constexpr double kStateBytes = 400;
constexpr double kUnlimitedDays = 7;  // for which a log without a limit needs space
constexpr double kSecondsPerDay = 86'400;
constexpr std::int64_t kMinJournalSpace = 64 << 20;

std::string Size(double bytes) {
  static constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  while (bytes >= 1'024 && unit + 1 < kUnits.size()) {
    bytes /= 1'024;
    ++unit;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g %s", bytes, kUnits[unit]);
  return text.data();
}

// Returns the maximum rate of a log in bytes per second.
double RateOf(const MachineConfig& machine, const LogConfig& log) {
  ChannelFilter filter;
  if (!filter.Set(log.channels, log.invert)) return 0;
  const auto takes = [&](const char* kind, const std::string& name) {
    return filter.Matches(machine.lcm.prefix + kind + '/' + name);
  };
  double rate = 0;
  for (const BusConfig& bus : machine.buses) {
    if (takes("BUS", bus.name)) rate += kStateBytes;
    for (const DeviceConfig& device : bus.devices) {
      if (takes(bus.family->has_position ? "POSITION" : "MOTOR", device.name)) {
        rate += MessageRate(bus, device) * kPositionBytes;
      }
      if (takes("DEVICE", device.name)) rate += kStateBytes;
      if (takes("ALARM", device.name)) rate += kStateBytes;
    }
  }
  return rate;
}

// Returns the size in bytes to which the log may grow.
double NeedOf(const MachineConfig& machine, const LogConfig& log) {
  const auto quota = static_cast<double>(log.quota_bytes);
  if (!log.trigger.empty()) return quota;  // records only around events
  const double days = log.keep > 0 ? static_cast<double>(log.keep) / 1e9 / kSecondsPerDay : kUnlimitedDays;
  const double by_time = RateOf(machine, log) * days * kSecondsPerDay;
  return quota > 0 ? std::min(quota, by_time) : by_time;
}

struct FolderUse {
  HostFolder HostFacts::*folder;
  const char* what;
  const char* key;  // in the machine file
};
constexpr FolderUse kLogs = {&HostFacts::logs, "the folder of the recorder's logs", "recorder.directory"};
constexpr FolderUse kJournal = {&HostFacts::journal, "the folder of the bridge's journal", "bridge.journal"};

template <const FolderUse& Use>
Symptoms Unwritable(const MachineConfig&, const HostFacts& host) {
  const HostFolder& folder = host.*Use.folder;
  if (folder.path.empty() || (folder.is_folder && folder.writable)) return {};
  const std::string reason = !folder.is_folder ? folder.existing + " is not a folder"
                             : folder.existing == folder.path
                                 ? "this user may not write into it"
                                 : "it does not exist, and this user may not create it in " + folder.existing;
  return {{.found = folder.path + ", " + Use.what + ": " + reason,
           .fixes = {Manual("install -d -o USER -g axlecast -m 2775 " + folder.path +
                            "    # USER: the account of the process; or correct " + Use.key +
                            " in the machine file")}}};
}

bool IsMemory(const HostFolder& folder) { return folder.file_system == "tmpfs" || folder.file_system == "ramfs"; }

template <const FolderUse& Use>
Symptoms OnFileSystem(const MachineConfig&, const HostFacts& host) {
  const HostFolder& folder = host.*Use.folder;
  if (folder.path.empty() || folder.file_system.empty()) return {};
  return {{.found = folder.path + ", " + Use.what + ", is on " + folder.file_system +
                    (IsMemory(folder) ? ", which is memory" : ""),
           .fixes = {Manual(std::string("set ") + Use.key +
                            " in the machine file to a folder on a disk of this host, such as "
                            "/var/lib/axlecast or /var/log/axlecast")}}};
}

Symptoms CheckLogSpace(const MachineConfig& machine, const HostFacts& host) {
  if (host.logs.path.empty()) return {};
  double need = 0;
  double used = 0;
  bool unlimited = false;
  for (const LogConfig& log : machine.recorder.logs) {
    need += NeedOf(machine, log);
    unlimited = unlimited || (log.keep == 0 && log.quota_bytes == 0);
    const auto bytes = host.log_bytes.find(log.name);
    if (bytes != host.log_bytes.end()) used += static_cast<double>(bytes->second);
  }
  const auto free = static_cast<double>(host.logs.free_bytes);
  // Logs without a limit grow in addition to the existing files; others replace them.
  if (free + (unlimited ? 0 : used) >= need) return {};
  return {{.found = "the recorder's logs may need " + Size(need) + (unlimited ? " in a week" : "") + "; " +
                    host.logs.existing + " has " + Size(free) + " free, and the existing logs take " + Size(used),
           .fixes = {Manual(
               "set recorder.logs.*.quota in the machine file (quota: " +
               std::to_string(std::max<std::int64_t>(2, static_cast<std::int64_t>((free + used) * 0.8) >> 20)) +
               "MB for all logs together), a shorter keep, or recorder.directory on a larger disk")}}};
}

Symptoms CheckJournalSpace(const MachineConfig&, const HostFacts& host) {
  if (host.journal.path.empty() || host.journal.free_bytes >= kMinJournalSpace) return {};
  return {
      {.found = host.journal.existing + ", where the bridge's journal is, has " +
                Size(static_cast<double>(host.journal.free_bytes)) + " free",
       .fixes = {Manual("du -xh " + host.journal.existing + " | sort -h | tail    # shows the largest folders")}}};
}

constexpr auto kChecks = std::to_array<Check>({
    {"log_folder", Severity::kError, "the recorder can write into its folder", "Nothing is recorded.",
     &Unwritable<kLogs>},
    {"log_space", Severity::kWarning,
     "the disk has space for the recorder's quota or keep at the machine's message rate",
     "The disk fills up before the oldest logs are deleted. Recording stops with the alarm disk_full.",
     &CheckLogSpace},
    {"log_file_system", Severity::kWarning, "logs are on a disk of this host",
     "In memory, logs are lost at a restart. On a network or FAT (4 GB per file), writing can stall or stop.",
     &OnFileSystem<kLogs>},
    {"journal_folder", Severity::kError, "the bridge can write its journal",
     "The bridge does not start. No command is executed.", &Unwritable<kJournal>},
    {"journal_space", Severity::kError, "the journal's disk has 64 MB free",
     "If the journal is full, commands that change a device are refused.", &CheckJournalSpace},
    {"journal_file_system", Severity::kWarning, "the journal is on a disk of this host",
     "In memory, datums and outcomes are lost at a restart. On a network, file locks are not safe for SQLite.",
     &OnFileSystem<kJournal>},
});

}  // namespace

std::span<const Check> DiskChecks() { return kChecks; }

}  // namespace axlecast
