#pragma once

#include <gtest/gtest.h>

#include <string>

#include "core/config/load.h"
#include "tools/doctor/check.h"

namespace axlecast {

// The machine that this text describes.
inline MachineConfig MachineOf(const std::string& text) {
  ConfigErrors errors("m.yaml");
  std::optional<MachineConfig> machine = ParseConfig("machine: test\n" + text, errors);
  EXPECT_TRUE(machine) << errors.Text();
  if (!machine) return {};
  machine->file = "m.yaml";
  return *machine;
}

// One T-format axis on /dev/ttyUSB0; `keys` are the bus's, `rest` the file's.
inline MachineConfig OneAxis(const std::string& keys = "", const std::string& rest = "") {
  return MachineOf(rest +
                   "\nbuses:\n  b0:\n    family: tformat\n    link: {port: /dev/ttyUSB0, baud: 2500000}\n    " +
                   keys + "\n    devices: {axis1: {model: ts5669n127, unit: deg, publish_hz: 100}}\n");
}

// A path that cannot be looked at, with the errno why.
inline HostFile Unseen(const std::string& path, int error) {
  HostFile file;
  file.path = path;
  file.error = error;
  return file;
}

// A host on which all is well for it.
inline HostFacts GoodHost() {
  HostFacts host;
  host.user = 1000;
  for (const char* url : {"udpm://239.255.76.67:7667?ttl=0", "udpm://239.255.76.67:7668?ttl=0"}) {
    host.network.groups[url] = {.route = {.error = 0, .interface = "lo"}, .interface_problem = "", .silence = ""};
  }
  host.network.loopback = {.known = true, .up = true, .multicast = true};
  host.network.receive_max = host.network.receive_default = 64 << 20;
  PortFacts& port = host.ports["/dev/ttyUSB0"];
  port.file = {.path = "/dev/ttyUSB0",
               .kind = HostFile::Kind::kCharacter,
               .mode = 0660,
               .gid = 20,
               .owner = "root",
               .group = "dialout",
               .readable = true,
               .writable = true};
  host.clock.known = true;
  host.clock.synchronised = true;
  return host;
}

inline Symptoms RunCheck(std::string_view name, const MachineConfig& machine, const HostFacts& host) {
  return FindCheck(name)->run(machine, host);
}

}  // namespace axlecast
