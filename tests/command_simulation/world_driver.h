#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/command_simulation/faults.h"
#include "tests/command_simulation/network.h"

namespace axlecast {

// What was really done to devices: the devices' own memory, which outlives every process.
struct WorldDevices {
  std::map<std::string, std::string> note;  // of each device, as `mark` wrote it last
  std::map<std::string, int> marks;         // how often each note was written, on any device

  std::function<void(const CommandId& id)> on_effect = [](const CommandId&) {};
  std::function<void(std::int64_t boot_id)> on_start = [](std::int64_t) {};  // of a driver
};

// One driver process with its devices. An order touches its device after a while, and is reported later still.
class WorldDriver {
 public:
  WorldDriver(const BusConfig& bus, const BridgeConfig& bridge, WorldNetwork& network, WorldClock& clock,
              std::mt19937& random, WorldDevices& devices);

  // As after kill -9: what was under way has touched its device or not.
  void Restart();
  void OnMessage(Bytes message);
  void Step();

  Faults faults;
  int restarts = 0;

 private:
  struct Job {
    std::string device;
    std::string operation;
    std::string note = {};  // `mark`: to be written; `look`: that is looked for
    MonoNs touch = 0;
    MonoNs done = 0;
    bool told = false;
    bool touched = false;
    Outcome outcome = {};
  };

  template <typename Work>
  void Alive(const Work& work);
  void Hello();
  void Begin(const DriverCommandServer::Taken& taken);
  void Advance(const CommandId& id, Job& job);
  void Touch(const CommandId& id, Job& job);
  void Cancel(const DriverCommandServer::Taken& cancel);
  [[nodiscard]] MonoNs RandomMs(int maximum) {
    return std::uniform_int_distribution<int>(0, maximum)(random_) * kMillisecond;
  }

  const BusConfig& bus_;
  const BridgeConfig& bridge_;
  WorldNetwork& network_;
  WorldClock& clock_;
  std::mt19937& random_;
  WorldDevices& devices_;
  FaultySink sink_;
  std::unique_ptr<DriverCommandServer> desk_;
  std::map<CommandId, Job> jobs_;
  MonoNs next_hello_ = 0;
};

}  // namespace axlecast
