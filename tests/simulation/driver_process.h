#pragma once

#include <map>
#include <memory>
#include <string>

#include "core/config/load.h"
#include "tests/simulation/network.h"
#include "tests/simulation/process_thread.h"
#include "tests/simulation/promises.h"
#include "tests/simulation/shaft_truth.h"
#include "tests/simulation/wire.h"
#include "tests/support/fixed_secrets.h"

namespace axlecast::simulation {

// The driver of one bus with its simulated devices. Every position that it publishes is compared with the truth.
class DriverProcess {
 public:
  // All but `seed` outlive it.
  DriverProcess(const MachineConfig& machine, const BusConfig& bus, Schedule& schedule, Host& host,
                Network& network, Promises& promises, std::uint64_t seed);

  void Start();
  void Kill();
  [[nodiscard]] bool runs() const { return thread_.runs(); }
  [[nodiscard]] ProcessThread& thread() { return thread_; }
  [[nodiscard]] Wire& wire() { return *wire_; }
  [[nodiscard]] const BusConfig& bus() const { return bus_; }
  [[nodiscard]] Host& host() { return host_; }

  // Changes a quantity of a device: docs/simulation.md. `settles`: how long its shaft may accelerate afterwards.
  void Set(const std::string& device, const std::string& key, const std::string& value, MonoNs settles);
  // Returns a quantity of a device.
  [[nodiscard]] std::string Quantity(const std::string& device, const std::string& key) const;
  // When the device published its newest valid position, or reading of a motor. Time of the schedule.
  [[nodiscard]] MonoNs last_valid(const std::string& device) const;

 private:
  void Run();
  void OnPublished(const std::string& channel, Bytes message);
  void JudgePosition(const std::string& device, Bytes message);

  const MachineConfig& machine_;
  const BusConfig& bus_;
  Schedule& schedule_;
  Host& host_;
  Network& network_;
  Promises& promises_;
  ProcessThread thread_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Wire> wire_;
  FixedSecrets secrets_;
  std::map<std::string, ShaftTruth> truths_;
  std::map<std::string, MonoNs> valid_;
  Driver* driver_ = nullptr;  // on the stack of the thread; null: it does not run
  int membership_ = -1;
};

}  // namespace axlecast::simulation
