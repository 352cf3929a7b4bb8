#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/simulation/disk.h"
#include "tests/simulation/network.h"
#include "tests/simulation/promises.h"
#include "tools/recorder/log_composer.h"
#include "tools/recorder/log_writer.h"

namespace axlecast::simulation {

// The recorder: composes logs from what arrives and writes them. Its logs are compared with what arrived.
class RecorderProcess {
 public:
  RecorderProcess(Schedule& schedule, Host& host, Network& network, Promises& promises)
      : schedule_(schedule), host_(host), network_(network), promises_(promises) {}

  void Start();
  // `choice`: what is left of its files. Judges what is left.
  void Kill(const CutChoice& choice);
  // Ends it as SIGTERM does, and judges all its logs.
  void Stop();
  [[nodiscard]] bool runs() const { return composer_ != nullptr; }

 private:
  static constexpr MonoNs kCycle = 100 * kMillisecond;

  void OnMessage(const std::string& channel, Bytes message);
  void Cycle(std::int64_t life);
  void JudgeLosses();
  // `complete`: nothing may be missing.
  void JudgeLogs(bool complete);

  // A message that arrived.
  struct Arrival {
    std::uint64_t hash = 0;
    MonoNs at = 0;  // of the schedule
  };
  struct Numbers {
    std::int64_t first = 0;
    std::int64_t last = 0;
    std::set<std::int64_t> all;
  };

  Schedule& schedule_;
  Host& host_;
  Network& network_;
  Promises& promises_;
  Disk disk_;
  std::unique_ptr<LogWriter> writer_;
  std::unique_ptr<LogComposer> composer_;
  std::vector<Arrival> arrivals_;                                    // of this life
  std::map<std::pair<std::string, std::int64_t>, Numbers> numbers_;  // of this life, by channel and boot_id
  std::set<std::string> former_logs_;                                // names
  std::int64_t life_ = 0;
  int membership_ = -1;
};

}  // namespace axlecast::simulation
