#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/store/durable_store.h"
#include "client/command/command_session.h"
#include "tests/simulation/driver_process.h"
#include "tests/simulation/network.h"
#include "tests/simulation/promises.h"

namespace axlecast::simulation {

// Operators who command devices, and the judge of what became of their commands.
class Operators {
 public:
  using DriverOf = std::function<DriverProcess&(const std::string& device)>;

  Operators(Schedule& schedule, Host& host, Network& network, Promises& promises, DriverOf driver_of,
            std::uint64_t seed);

  // Sends one command to any device. `patience`: the client dies or gives up after this time; kNever: it follows the command to its end.
  void Command(MonoNs patience, bool cancels);
  // Shelves this number of alarms of one device, each with a name that no device has: shelves are bounded.
  void ShelveInventedAlarms(int number);
  [[nodiscard]] std::size_t open() const;
  // At the end, when nothing is under way any more: one outcome for each, which agrees with what was done to the devices.
  void Judge(DurableStore& journal);

 private:
  // What is commanded, and the counter of the simulator that increases each time it is done; empty: nothing changes.
  struct Order {
    std::string device;
    std::string operation;
    std::string counter = {};
    bool sets_datum = false;
    bool shelves = false;
  };
  struct Client {
    const Order* order = nullptr;
    std::int64_t counts = 0;                     // that its datum sets
    std::optional<CommandSession> session = {};  // none: its process died
    CommandResult result = {};
    MonoNs cancel_at = kNever;  // of the schedule, as die_at
    MonoNs die_at = kNever;
    std::set<int> outcomes = {};  // final states that any bridge ever reported
    bool not_noted = false;       // an outcome stated that the journal has not noted it
  };
  // How often something was done, as the outcomes state it.
  struct Bounds {
    std::int64_t least = 0;
    std::int64_t most = 0;
  };

  void Send(const Order& order, MonoNs patience, bool cancels);
  void OnStatus(Bytes message);
  void Cycle();
  void Advance(Client& client);
  void JudgeOutcome(const CommandId& id, const Client& client, const command_status_t& journalled);
  void JudgeDatum(const CommandId& id, const Client& client, const command_status_t& journalled,
                  DurableStore& journal);
  [[nodiscard]] static Bounds DoneBy(const command_status_t& status);

  static constexpr MonoNs kCycle = 10 * kMillisecond;

  Schedule& schedule_;
  Host& host_;
  HostPort port_;
  Promises& promises_;
  const DriverOf driver_of_;
  Random random_;
  const std::vector<Order> orders_;
  std::map<CommandId, Client> clients_;
  std::map<CommandId, Client*> open_;
  std::uint32_t sent_ = 0;
};

}  // namespace axlecast::simulation
