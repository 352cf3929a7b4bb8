#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bridge/dispatch/dispatcher.h"
#include "bridge/store/memory_store_fixture.h"
#include "bridge/store/sqlite_store.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/network.h"
#include "tests/simulation/promises.h"

namespace axlecast::simulation {

// The bridge with its journal in SQLite.
class BridgeProcess {
 public:
  // All outlive it.
  BridgeProcess(const MachineConfig& machine, Schedule& schedule, Host& host, Network& network, Promises& promises)
      : machine_(machine), schedule_(schedule), host_(host), network_(network), promises_(promises) {}

  void Start();
  // `choice`: what is left of its files.
  void Kill(const CutChoice& choice);
  // As SIGSTOP and SIGCONT: what arrives meanwhile waits.
  void Freeze(MonoNs until) { frozen_until_ = std::max(frozen_until_, until); }
  // From now on, the disk answers nothing, or again.
  void StallDisk(bool stalled);
  [[nodiscard]] bool runs() const { return dispatcher_ != nullptr; }
  // The journal of a bridge that runs.
  [[nodiscard]] DurableStore& store() { return *store_; }
  [[nodiscard]] bool accepts_changes() const;
  // What it keeps is bounded, for any commands.
  void JudgeBounds();

 private:
  static constexpr MonoNs kTick = 10 * kMillisecond;
  static constexpr std::size_t kInbox = 2'000;  // messages: the socket's buffer

  [[nodiscard]] Timestamp Now();
  // An epoch of an order is never one of an earlier life: drivers rely on it.
  void JudgeEpoch(const std::string& channel, Bytes message);
  void OnMessage(const std::string& channel, Bytes message);
  void Handle(const std::string& channel, Bytes message);
  void Tick(std::int64_t life);

  const MachineConfig& machine_;
  Schedule& schedule_;
  Host& host_;
  Network& network_;
  Promises& promises_;
  Disk disk_;
  std::unique_ptr<SqliteStore> store_;
  std::unique_ptr<InlineJournal> journal_;
  std::unique_ptr<HostPort> commands_;
  std::unique_ptr<HostPort> data_;
  std::unique_ptr<Dispatcher> dispatcher_;
  Timebase time_;
  std::deque<std::pair<std::string, std::vector<std::uint8_t>>> inbox_;  // while it is frozen
  MonoNs frozen_until_ = 0;
  std::int64_t life_ = 0;
  std::int64_t newest_epoch_ = 0;  // of this life
  std::int64_t former_epoch_ = 0;  // the newest of all lives before
  int membership_ = -1;
};

}  // namespace axlecast::simulation
