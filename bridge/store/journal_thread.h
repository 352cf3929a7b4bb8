#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "bridge/store/journal_worker.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The thread that has the journal to itself: it makes the store, runs the work on it, and destroys it.
class JournalThread final : public JournalWorker {
 public:
  explicit JournalThread(std::function<std::unique_ptr<DurableStore>()> make);
  // Runs what was given still, and waits for it: see Finish.
  ~JournalThread() override;
  JournalThread(const JournalThread&) = delete;
  JournalThread& operator=(const JournalThread&) = delete;

  void Run(Work work) override;
  [[nodiscard]] std::size_t TakeFinished() override;
  // Readable when TakeFinished has something to count.
  [[nodiscard]] int FileDescriptor() const { return progress_.FileDescriptor(); }

  // Lets the thread run what was given, destroy the store and end. Returns at once.
  void Finish();
  // It has done so. Until then this object cannot be destroyed without waiting for the disk.
  [[nodiscard]] bool ended();

 private:
  void Loop(const std::function<std::unique_ptr<DurableStore>()>& make);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Work> waiting_;
  std::size_t finished_ = 0;
  WakeEvent progress_;  // of finished_
  bool stopping_ = false;
  bool ended_ = false;
  std::thread thread_;  // last: it uses all of the others
};

}  // namespace axlecast
