#pragma once

#include <cstddef>
#include <deque>
#include <utility>

#include "bridge/store/journal_worker.h"

namespace axlecast {

// For tests: runs work in the caller's thread, at once, or when the test allows it: a disk that has stalled.
class InlineJournal final : public JournalWorker {
 public:
  explicit InlineJournal(DurableStore& store) : store_(store) {}

  void Run(Work work) override {
    waiting_.push_back(std::move(work));
    if (!stalled_) RunWaiting();
  }
  std::size_t TakeFinished() override { return std::exchange(finished_, 0); }

  // From now on nothing is run.
  void Stall() { stalled_ = true; }
  // Runs what waits, and everything from now on at once.
  void Recover() {
    stalled_ = false;
    RunWaiting();
  }
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  void RunWaiting() {
    while (!waiting_.empty()) {
      const Work work = std::move(waiting_.front());
      waiting_.pop_front();
      work(store_);
      ++finished_;
    }
  }

  DurableStore& store_;
  std::deque<Work> waiting_;
  std::size_t finished_ = 0;
  bool stalled_ = false;
};

}  // namespace axlecast
