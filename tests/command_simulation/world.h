#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "bridge/dispatch/dispatcher.h"
#include "client/command/command_session.h"
#include "tests/command_simulation/command_trace.h"
#include "tests/command_simulation/faults.h"
#include "tests/command_simulation/network.h"
#include "tests/command_simulation/world_driver.h"
#include "tests/support/counting_family.h"

namespace axlecast {

// For tests: clients, a bridge, drivers and devices in virtual time, on a network that loses, doubles and reorders,
// killed at any instant. All but the devices and the network is the product's own. Whatever happens, a command acts
// at most once, has one outcome, and this outcome agrees with what was really done to the device.

struct WorldSettings {
  std::uint32_t seed = 1;
  NetworkSettings network = {};
  int buses = 5;
  int devices_per_bus = 4;
  double driver_kills_per_s = 0;  // of each
  double bridge_kills_per_s = 0;
  double client_kills = 0;  // share of commands whose client dies after a while
  double cancels = 0;       // share of commands that are given up after a while
  double short_lived = 0;   // share that may wait for 1..100 ms only
  double reads = 0;         // share that only looks
  bool traced = false;      // World::trace() is written; for one driver
};

// What became of the commands.
struct WorldTally {
  std::map<std::string, int> outcomes;  // by word
  std::map<std::string, int> reasons;   // by word, of those that did not succeed
  int effects = 0;                      // done to devices
  int bridge_kills = 0;
  int driver_kills = 0;
  std::vector<std::string> breaches;  // of the property, each with the command's id
};

class World {
 public:
  explicit World(WorldSettings settings);

  // Sends `count` commands, two at a time per device, follows each to its end, and waits until the journal has an
  // outcome of every one. False when it takes for ever.
  [[nodiscard]] bool Run(std::uint32_t count);
  [[nodiscard]] WorldTally Judge() const;
  [[nodiscard]] const CommandTrace& trace() const { return trace_; }

  Faults bridge_faults;
  [[nodiscard]] Faults& driver_faults(const std::string& bus) { return drivers_.at(bus)->faults; }

 private:
  // One command and its client.
  struct Client {
    std::string note;  // what it writes: its own
    bool reads = false;
    std::optional<CommandSession> session;  // none: its process was killed
    CommandResult result;
    MonoNs cancel_at = kNever;
    MonoNs kill_at = kNever;
    std::set<int> outcomes;  // final states that any bridge ever reported
  };

  void Trace();
  void StartOne(std::uint32_t number);
  void Advance(Client& client);
  void OnMessage(const std::string& channel, Bytes message);
  void OnStatus(const command_status_t& status);
  void Millisecond();
  void StartBridge();
  void KillBridge();
  template <typename Work>
  void WithBridge(const Work& work);
  void JudgeOne(const CommandId& id, const Client& client, WorldTally& tally) const;
  [[nodiscard]] Timestamp Now() const { return {clock_.now, clock_.UtcMicroseconds()}; }

  const WorldSettings settings_;
  std::mt19937 random_;
  WorldClock clock_;
  WorldNetwork network_;
  MachineConfig machine_;
  CommandTrace trace_;
  TracedStore store_;
  FaultyStore faulty_store_{store_, bridge_faults};
  FaultySink faulty_sink_{network_, bridge_faults};
  std::unique_ptr<InlineJournal> journal_;
  std::unique_ptr<Dispatcher> bridge_;  // null: killed
  std::int64_t bridge_boots_ = 0;
  MonoNs bridge_starts_ = 0;
  WorldDevices devices_;
  std::map<std::string, std::unique_ptr<WorldDriver>> drivers_;
  std::map<CommandId, Client> clients_;
  std::map<CommandId, Client*> open_;
};

}  // namespace axlecast
