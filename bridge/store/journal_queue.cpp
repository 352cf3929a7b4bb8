#include "bridge/store/journal_queue.h"

#include <cstdint>
#include <utility>

namespace axlecast {

bool JournalQueue::WriteBacklog(Backlog& backlog, DurableStore& store) {
  while (!backlog.empty() && backlog.front()(store)) backlog.pop_front();
  return backlog.empty();
}

void JournalQueue::Run(std::function<bool(DurableStore&, Backlog&)> work, Done done, MonoNs now) {
  auto finished = std::make_shared<Finished>();
  pending_.push_back({finished, std::move(done), now});
  worker_.Run([finished, work = std::move(work), backlog = backlog_](DurableStore& store) {
    finished->written = work(store, *backlog);
    finished->store_state = store.state();
    finished->unwritten = backlog->size();
  });
}

void JournalQueue::Give(Work work, Done done, MonoNs now) {
  Run([work = std::move(work)](DurableStore& store,
                               Backlog& backlog) { return WriteBacklog(backlog, store) && work(store); },
      std::move(done), now);
}

void JournalQueue::Keep(Work work, MonoNs now) {
  Run(
      [work = std::move(work)](DurableStore& store, Backlog& backlog) {
        backlog.push_back(work);
        return WriteBacklog(backlog, store);
      },
      nullptr, now);
}

void JournalQueue::Ask(Work work, Done done, MonoNs now) {
  Run(
      [work = std::move(work)](DurableStore& store, Backlog& backlog) {
        const bool answer = work(store);
        if (store.state()) WriteBacklog(backlog, store);
        return answer;
      },
      std::move(done), now);
}

void JournalQueue::Settle() {
  for (std::size_t finished = worker_.TakeFinished(); finished > 0; finished = worker_.TakeFinished()) {
    for (; finished > 0 && !pending_.empty(); --finished) {
      const Pending pending = std::move(pending_.front());
      pending_.pop_front();
      store_state_ = pending.finished->store_state;
      unwritten_ = pending.finished->unwritten;
      if (pending.done) pending.done(pending.finished->written);
    }
  }
}

MonoNs JournalQueue::Age(MonoNs now) const { return pending_.empty() ? 0 : now - pending_.front().given; }

bool JournalQueue::IsFull() const { return pending_.size() + unwritten_ >= kMaxWaiting; }

Result<> JournalQueue::Check(MonoNs now) const {
  if (IsStalled(now)) {
    const std::int64_t tenths = Age(now) / (100 * kMillisecond);
    return Failure("its disk has not answered for " + std::to_string(tenths / 10) + '.' +
                   std::to_string(tenths % 10) +
                   " s: look at the kernel's log (dmesg) and at what else writes to that disk");
  }
  if (IsFull()) {
    return Failure(std::to_string(kMaxWaiting) +
                   " changes wait to be written: its disk is too slow (iostat -x), or has failed");
  }
  return store_state_;
}

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
