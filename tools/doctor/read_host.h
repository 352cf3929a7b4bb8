#pragma once

#include "tools/doctor/host/host_files.h"
#include "tools/doctor/host_facts.h"

namespace axlecast {

struct ReadHostOptions {
  HostFiles files;
  MonoNs listen = 1'500 * kMillisecond;  // for drivers, which report once a second; 0: does not
  bool hear_machine = true;              // where one of its drivers was heard, also for what the machine reports
};

// Reads what the checks want to know of this host for this machine. Opens no port and sends nothing but a datagram to
// itself. The machine's own files (keys, logs, journal) are those of this process, whatever root `files` has.
[[nodiscard]] HostFacts ReadHost(const MachineConfig& machine, const ReadHostOptions& options);

}  // namespace axlecast
