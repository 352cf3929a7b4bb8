#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/simulation/bridge_process.h"
#include "tests/simulation/consumer.h"
#include "tests/simulation/driver_process.h"
#include "tests/simulation/fault_plan.h"
#include "tests/simulation/operators.h"
#include "tests/simulation/recorder_process.h"
#include "tests/simulation/time_process.h"

namespace axlecast::simulation {

// The whole machine of machine.yaml on two hosts, in one thread and in virtual time: the product's own drivers, bridge, journal,
// recorder, time base and client libraries; simulated devices, wires, network, clocks and disks. One seed, one run: it is the same on
// every machine.
class SimulatedMachine {
 public:
  // How long everything runs before the first fault, and by when everything works again after the last one.
  static constexpr MonoNs kRunIn = 10 * kSecond;
  static constexpr MonoNs kRecovery = 30 * kSecond;
  static constexpr MonoNs kOutcomes = 90 * kSecond;  // by when every command has its outcome

  SimulatedMachine(const MachineConfig& machine, std::uint64_t seed);
  ~SimulatedMachine();

  // Runs for kRunIn, then for `time` with these faults, and until everything has recovered. Ends at the first breach. Call it once.
  void Run(MonoNs time, const std::vector<Fault>& faults);

  [[nodiscard]] const Promises& promises() const { return promises_; }
  [[nodiscard]] MonoNs now() const { return schedule_.now(); }

 private:
  // Ends earlier after a breach, or when `done` is true.
  void RunUntil(MonoNs until, const std::function<bool()>& done);
  // What ends a fault; empty: nothing does.
  using End = std::function<void()>;
  [[nodiscard]] End Begin(const Fault& fault);
  [[nodiscard]] End BeginOnProcess(const Fault& fault);
  [[nodiscard]] static End BeginOnWire(const Fault& fault, DriverProcess& driver);
  [[nodiscard]] static End BeginOnDevice(const Fault& fault, DriverProcess& driver);
  [[nodiscard]] End BeginOnNetwork(const Fault& fault);
  [[nodiscard]] static End BeginOnHost(const Fault& fault, Host& host);
  void GiveCommands(MonoNs until);
  // Returns what does not work, or an empty text.
  [[nodiscard]] std::string Missing();
  [[nodiscard]] DriverProcess& DriverOfDevice(const std::string& device);
  [[nodiscard]] DriverProcess& DriverAt(std::uint64_t target) { return *drivers_[target % drivers_.size()]; }
  [[nodiscard]] Host& HostAt(std::uint64_t target) { return target % 2 == 0 ? left_ : right_; }
  [[nodiscard]] TimeProcess& TimeAt(std::uint64_t target) { return target % 2 == 0 ? left_time_ : right_time_; }

  Random random_;
  Schedule schedule_;
  Promises promises_;
  Network network_;
  Host left_;
  Host right_;
  std::vector<std::unique_ptr<DriverProcess>> drivers_;
  TimeProcess left_time_;
  TimeProcess right_time_;
  BridgeProcess bridge_;
  RecorderProcess recorder_;
  Operators operators_;
  Consumer consumer_;
};

// Reads machine.yaml. Throws if it is wrong.
[[nodiscard]] MachineConfig ReadSimulatedMachine();

}  // namespace axlecast::simulation
