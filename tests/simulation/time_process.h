#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/config/machine_config.h"
#include "core/time/time_keeper.h"
#include "tests/simulation/network.h"
#include "tests/simulation/promises.h"

namespace axlecast::simulation {

// The process that keeps the time base on one host: axlecast time. Each claim is compared with the truth.
class TimeProcess {
 public:
  // `root`: the process on the root; the object itself there. All outlive it.
  TimeProcess(const MachineConfig& machine, Schedule& schedule, Host& host, TimeProcess& root, Network& network,
              Promises& promises)
      : machine_(machine), schedule_(schedule), host_(host), root_(root), network_(network), promises_(promises) {}

  void Start();
  void Kill();
  void Freeze(MonoNs until) { frozen_until_ = std::max(frozen_until_, until); }
  [[nodiscard]] bool runs() const { return keeper_ != nullptr; }
  [[nodiscard]] Host& host() { return host_; }

 private:
  static constexpr MonoNs kCycle = 100 * kMillisecond;

  [[nodiscard]] bool IsRoot() const { return &root_ == this; }
  [[nodiscard]] std::int64_t BaseId() const { return NameHash("raw clock of " + host_.name); }
  void Cycle(std::int64_t life);
  void Request();
  // On the root.
  void OnRequest(TimeProcess& from, MonoNs sent, std::int64_t life);
  void Publish();

  const MachineConfig& machine_;
  Schedule& schedule_;
  Host& host_;
  TimeProcess& root_;
  Network& network_;
  Promises& promises_;
  std::unique_ptr<TimeKeeper> keeper_;  // null: it does not run
  Origin origin_;
  std::int64_t seq_ = 0;
  std::int64_t life_ = 0;
  MonoNs frozen_until_ = 0;
};

}  // namespace axlecast::simulation
