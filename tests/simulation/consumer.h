#pragma once

#include <axlecast/position_tracker.h>
#include <axlecast/time_base.h>
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "tests/simulation/network.h"
#include "tests/simulation/promises.h"

namespace axlecast::simulation {

// A control process on one host that follows every axis of the machine. Judges the instants that it is given on the time base, and
// whether an axis that is called fresh is.
class Consumer {
 public:
  // `host_of`: by clock_id. `last_valid`: when a device published its newest valid position, in time of the schedule.
  using HostOf = std::function<const Host*(std::int64_t clock_id)>;
  using LastValid = std::function<MonoNs(const std::string& device)>;

  Consumer(Schedule& schedule, Host& host, const Host& root, Network& network, Promises& promises, HostOf host_of,
           LastValid last_valid);

 private:
  static constexpr MonoNs kCycle = 50 * kMillisecond;

  void OnMessage(const std::string& channel, Bytes message);
  void OnPosition(const std::string& device, const position_t& position);
  void Cycle();

  Schedule& schedule_;
  Host& host_;
  const Host& root_;
  Promises& promises_;
  const HostOf host_of_;
  const LastValid last_valid_;
  TimeBase time_;
  std::map<std::string, PositionTracker> trackers_;
  std::map<std::string, std::int64_t> max_age_us_;
};

}  // namespace axlecast::simulation
