#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "core/device/can.h"

namespace axlecast {
namespace {

constexpr std::int64_t kBitrateShare =
    100;                           // 1 % deviation is allowed: a controller cannot divide its clock exactly
constexpr int kWarningCount = 96;  // of an error counter: a heavily disturbed bus (ISO 11898-1)
constexpr std::int64_t kCommandsPerNode = 2;  // that may be queued at once
constexpr std::int64_t kMinQueue = 100;
constexpr const char* kRulesFile = "/etc/udev/rules.d/99-axlecast.rules";

// Calls Look(bus, interface, symptoms) for each existing CAN interface.
template <auto Look>
Symptoms ForEachInterface(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto reply = host.can.find(bus->link.port);
    if (reply == host.can.end()) continue;
    if (reply->second && reply->second->is_can) Look(*bus, *reply->second, symptoms);
  }
  return symptoms;
}

Symptom Found(const BusConfig& bus, const std::string& what, const std::string& line) {
  return {.found = "bus " + bus.name + ": " + bus.link.port + ' ' + what, .fixes = {Manual(line)}};
}

std::string SetUpAgainLine(const BusConfig& bus, const CanInterface& interface) {
  return CanAgainLine(bus.link.port, bus.link.bitrate, interface.restarts);
}

void LookAtMode(const BusConfig& bus, const CanInterface& interface, Symptoms& symptoms) {
  const std::string again = SetUpAgainLine(bus, interface);
  if (interface.loopback)
    symptoms.push_back(Found(bus, "receives only its own frames (loopback)", again + " loopback off"));
  if (interface.listen_only) {
    symptoms.push_back(Found(bus, "sends and acknowledges nothing (listen-only)", again + " listen-only off"));
  }
  if (interface.presume_ack) {
    symptoms.push_back(
        Found(bus, "confirms frames that no node has acknowledged (presume-ack)", again + " presume-ack off"));
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

void LookAtState(const BusConfig& bus, const CanInterface& interface, Symptoms& symptoms) {
  const char* const state = StateText(interface.state);
  if (state == nullptr && std::max(interface.tec, interface.rec) < kWarningCount) return;
  std::string text = state == nullptr ? "counts errors" : std::string("is in state ") + state;
  if (interface.tec >= 0) {
    text += " (transmit errors " + std::to_string(interface.tec) + ", receive errors " +
            std::to_string(interface.rec) + ')';
  }
  Symptom symptom =
      Found(bus, text,
            "check the cable, both terminating resistors (60 ohm between CAN_H and CAN_L with the power "
            "off) and every node's bit rate");
  if (interface.state == CanController::State::kBusOff) {
    symptom.fixes.push_back(Manual(CanRestartLine(bus.link.port)));
  }
  symptoms.push_back(std::move(symptom));
}

Symptoms CheckCanMissing(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto reply = host.can.find(bus->link.port);
    if (reply == host.can.end()) continue;
    const CanInterfaceReply& interface = reply->second;
    if (interface && interface->is_can) continue;
    const std::string what = interface ? "is not a CAN interface"
                             : interface.error() == ENODEV
                                 ? "does not exist"
                                 : std::string("cannot be read: ") + std::strerror(interface.error());
    symptoms.push_back(Found(
        *bus, what,
        "ip -brief link show type can    # lists the interfaces; then correct link.iface in the machine file"));
  }
  return symptoms;
}

void LookWhetherDown(const BusConfig& bus, const CanInterface& interface, Symptoms& symptoms) {
  if (interface.up) return;
  symptoms.push_back(Found(bus, "is down",
                           interface.is_controller ? CanUpLine(bus.link.port, bus.link.bitrate, interface.restarts)
                                                   : "ip link set " + bus.link.port + " up"));
}

void LookAtBitrate(const BusConfig& bus, const CanInterface& interface, Symptoms& symptoms) {
  const std::int64_t configured = bus.link.bitrate;
  if (!interface.up || interface.bitrate <= 0 ||
      std::abs(interface.bitrate - configured) <= configured / kBitrateShare) {
    return;
  }
  symptoms.push_back(Found(
      bus,
      "is at " + std::to_string(interface.bitrate) + " bit/s, the machine file has " + std::to_string(configured),
      SetUpAgainLine(bus, interface)));
}

void LookAtRestart(const BusConfig& bus, const CanInterface& interface, Symptoms& symptoms) {
  if (!interface.up || !interface.restarts || interface.restart_ms != 0) return;
  symptoms.push_back(Found(bus, "stays off after a bus-off (restart-ms 0)", SetUpAgainLine(bus, interface)));
}

Symptoms CheckCanQueue(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const auto queue = host.can_queues.find(bus->link.port);
    const auto nodes = static_cast<std::int64_t>(bus->devices.size());
    if (queue == host.can_queues.end() || queue->second >= kCommandsPerNode * nodes) continue;
    const std::string length = std::to_string(std::max(kMinQueue, kCommandsPerNode * nodes));
    symptoms.push_back(
        {.found = "bus " + bus->name + ": " + bus->link.port + " queues at most " + std::to_string(queue->second) +
                  " frames, for " + std::to_string(nodes) + " nodes",
         .fixes = {Run({"ip", "link", "set", bus->link.port, "txqueuelen", length}),
                   Append(kRulesFile, R"(ACTION=="add", SUBSYSTEM=="net", KERNEL==")" + bus->link.port +
                                          R"(", ATTR{tx_queue_len}=")" + length + '"')},
         .safe = true});
  }
  return symptoms;
}

constexpr auto kChecks = std::to_array<Check>({
    {"can_missing", Severity::kError, "every CAN interface in the machine file exists",
     "The bus stays DOWN and its devices OFFLINE.", &CheckCanMissing},
    {"can_down", Severity::kError, "every CAN interface is up", "The bus stays DOWN and its devices OFFLINE.",
     &ForEachInterface<&LookWhetherDown>},
    {"can_bitrate", Severity::kError, "CAN interfaces have the bit rate of the machine file",
     "The driver refuses the bus, because a wrong bit rate disturbs all nodes.", &ForEachInterface<&LookAtBitrate>},
    {"can_mode", Severity::kError, "CAN interfaces send, acknowledge and receive",
     "Commands do not reach the nodes, or count as acknowledged without any node.", &ForEachInterface<&LookAtMode>},
    {"can_restart", Severity::kWarning, "CAN controllers restart after a bus-off",
     "After one short circuit, the bus is off until an operator restarts it with ip link.",
     &ForEachInterface<&LookAtRestart>},
    {"can_state", Severity::kError, "CAN controllers detect no errors on the bus",
     "Frames are lost, late, or no longer sent.", &ForEachInterface<&LookAtState>},
    {"can_queue", Severity::kWarning, "CAN interfaces can queue two commands for each node",
     "Commands to many nodes at once are refused (ENOBUFS) and retried later.", &CheckCanQueue},
});

}  // namespace

std::span<const Check> CanChecks() { return kChecks; }

}  // namespace axlecast
