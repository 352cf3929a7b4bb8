#include "tools/doctor/can_checks.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/device/can.h"

namespace axlecast {
namespace {

constexpr std::int64_t kBitrateShare = 100;  // a hundredth off is what a controller's clock cannot do better
constexpr int kWarningCount = 96;            // of an error counter: ISO 11898-1 calls the bus heavily disturbed
constexpr std::int64_t kOrdersPerNode = 2;   // that may wait at once
constexpr std::int64_t kUsualQueue = 100;
constexpr const char* kRulesFile = "/etc/udev/rules.d/99-axlecast.rules";

// Calls look(bus, interface, findings) for each CAN interface that is there.
template <typename Look>
Symptoms ForEachInterface(const MachineConfig& machine, const HostFacts& host, Look look) {
  Symptoms findings;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto reply = host.can.find(bus->link.port);
    if (reply == host.can.end()) continue;
    const auto* const interface = std::get_if<CanInterface>(&reply->second);
    if (interface != nullptr && interface->is_can) look(*bus, *interface, findings);
  }
  return findings;
}

Symptom Found(const BusConfig& bus, const std::string& what, const std::string& line) {
  return {.found = "bus " + bus.name + ": " + bus.link.port + ' ' + what, .fixes = {Tell(line)}, .safe = false};
}

std::string AgainLine(const BusConfig& bus, const CanInterface& interface) {
  return CanAgainLine(bus.link.port, bus.link.bitrate, interface.restarts);
}

void LookAtMode(const BusConfig& bus, const CanInterface& interface, Symptoms& findings) {
  const std::string again = AgainLine(bus, interface);
  if (interface.loopback) findings.push_back(Found(bus, "hears itself alone (loopback)", again + " loopback off"));
  if (interface.listen_only) {
    findings.push_back(Found(bus, "sends and acknowledges nothing (listen-only)", again + " listen-only off"));
  }
  if (interface.presume_ack) {
    findings.push_back(Found(bus, "confirms what no node has read (presume-ack)", again + " presume-ack off"));
  }
}

const char* StateText(CanController::State state) {
  switch (state) {
    case CanController::State::kWarning:
      return "error-warning";
    case CanController::State::kPassive:
      return "error-passive";
    case CanController::State::kBusOff:
      return "bus-off";
    default:
      return nullptr;
  }
}

void LookAtState(const BusConfig& bus, const CanInterface& interface, Symptoms& findings) {
  const char* const state = StateText(interface.state);
  if (state == nullptr && std::max(interface.tec, interface.rec) < kWarningCount) return;
  std::string text = state == nullptr ? "counts errors" : std::string("is in state ") + state;
  if (interface.tec >= 0) {
    text += " (transmit errors " + std::to_string(interface.tec) + ", receive errors " +
            std::to_string(interface.rec) + ')';
  }
  Symptom finding =
      Found(bus, text,
            "check the cable, both terminating resistors (60 ohm between CAN_H and CAN_L with the power "
            "off) and every node's bit rate");
  if (interface.state == CanController::State::kBusOff) {
    finding.fixes.push_back(Tell(CanRestartLine(bus.link.port)));
  }
  findings.push_back(std::move(finding));
}

}  // namespace

Symptoms CheckCanMissing(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto reply = host.can.find(bus->link.port);
    if (reply == host.can.end()) continue;
    const auto* const interface = std::get_if<CanInterface>(&reply->second);
    if (interface != nullptr && interface->is_can) continue;
    const int error = interface == nullptr ? std::get<int>(reply->second) : 0;
    const std::string what = interface != nullptr ? "is no CAN interface"
                             : error == ENODEV    ? "does not exist"
                                                  : std::string("cannot be asked about: ") + std::strerror(error);
    findings.push_back(
        Found(*bus, what, "ip -brief link show type can    # what there is; then correct link.iface in the file"));
  }
  return findings;
}

Symptoms CheckCanDown(const MachineConfig& machine, const HostFacts& host) {
  return ForEachInterface(
      machine, host, [](const BusConfig& bus, const CanInterface& interface, Symptoms& findings) {
        if (interface.up) return;
        findings.push_back(Found(bus, "is down",
                                 interface.is_controller
                                     ? CanUpLine(bus.link.port, bus.link.bitrate, interface.restarts)
                                     : "ip link set " + bus.link.port + " up"));
      });
}

Symptoms CheckCanBitrate(const MachineConfig& machine, const HostFacts& host) {
  return ForEachInterface(
      machine, host, [](const BusConfig& bus, const CanInterface& interface, Symptoms& findings) {
        const std::int64_t wanted = bus.link.bitrate;
        if (!interface.up || interface.bitrate <= 0 ||
            std::abs(interface.bitrate - wanted) <= wanted / kBitrateShare) {
          return;
        }
        findings.push_back(Found(
            bus, "is at " + std::to_string(interface.bitrate) + " bit/s, the file says " + std::to_string(wanted),
            AgainLine(bus, interface)));
      });
}

Symptoms CheckCanMode(const MachineConfig& machine, const HostFacts& host) {
  return ForEachInterface(machine, host, &LookAtMode);
}

Symptoms CheckCanRestart(const MachineConfig& machine, const HostFacts& host) {
  return ForEachInterface(
      machine, host, [](const BusConfig& bus, const CanInterface& interface, Symptoms& findings) {
        if (!interface.up || !interface.restarts || interface.restart_ms != 0) return;
        findings.push_back(Found(bus, "stays off after a bus-off (restart-ms 0)", AgainLine(bus, interface)));
      });
}

Symptoms CheckCanState(const MachineConfig& machine, const HostFacts& host) {
  return ForEachInterface(machine, host, &LookAtState);
}

Symptoms CheckCanQueue(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto queue = host.can_queues.find(bus->link.port);
    const auto nodes = static_cast<std::int64_t>(bus->devices.size());
    if (queue == host.can_queues.end() || queue->second >= kOrdersPerNode * nodes) continue;
    const std::string length = std::to_string(std::max(kUsualQueue, kOrdersPerNode * nodes));
    findings.push_back(
        {.found = "bus " + bus->name + ": " + bus->link.port + " queues " + std::to_string(queue->second) +
                  " frames at most, for " + std::to_string(nodes) + " nodes",
         .fixes = {Run({"ip", "link", "set", bus->link.port, "txqueuelen", length}),
                   Append(kRulesFile, R"(ACTION=="add", SUBSYSTEM=="net", KERNEL==")" + bus->link.port +
                                          R"(", ATTR{tx_queue_len}=")" + length + '"')},
         .safe = true});
  }
  return findings;
}

}  // namespace axlecast
