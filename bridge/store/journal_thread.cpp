#include "bridge/store/journal_thread.h"

#include <utility>

namespace axlecast {

JournalThread::JournalThread(std::function<std::unique_ptr<DurableStore>()> make)
    : thread_([this, make = std::move(make)] { Loop(make); }) {}

JournalThread::~JournalThread() {
  Finish();
  thread_.join();
}

void JournalThread::Run(Work work) {
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(work));
  }
  changed_.notify_all();
}

std::size_t JournalThread::TakeFinished() {
  const std::lock_guard lock(mutex_);
  if (finished_ > 0) progress_.Take();
  return std::exchange(finished_, 0);
}

void JournalThread::Finish() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
}

bool JournalThread::ended() {
  const std::lock_guard lock(mutex_);
  return ended_;
}

void JournalThread::Loop(const std::function<std::unique_ptr<DurableStore>()>& make) {
  std::unique_ptr<DurableStore> store = make();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
    if (waiting_.empty()) break;
    const Work work = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    work(*store);
    lock.lock();
    ++finished_;
    progress_.Set();
  }
  lock.unlock();
  store.reset();
  lock.lock();
  ended_ = true;
}

}  // namespace axlecast
