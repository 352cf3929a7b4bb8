#include "bridge/store/journal_queue.h"

#include <algorithm>
#include <type_traits>

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

void DeviceMemory::Load(const std::string& device, const DeviceRecords& store) {
  axes_[device] = store.Find(device);
  datums_[device] = store.Datums(device);
  for (const DatumRecord& datum : datums_[device]) newest_ = std::max(newest_, datum.number);
  for (const AlarmMark& mark : store.Marks(device)) marks_[{device, mark.kind, mark.alarm}] = mark;
}

AxisRecord DeviceMemory::Find(const std::string& device) const {
  const auto found = axes_.find(device);
  return found == axes_.end() ? AxisRecord{} : found->second;
}

void DeviceMemory::SetDatum(const std::string& device, const DatumRecord& datum) {
  auto& datums = datums_[device];
  DatumRecord& kept = *datums.insert(datums.begin(), datum);
  kept.number = ++newest_;
  kept.voided_utime = 0;
  kept.void_reason.clear();
  axes_[device].datum = kept;
}

void DeviceMemory::VoidDatum(const std::string& device, const DatumVoided& voided) {
  AxisRecord& axis = axes_[device];
  for (DatumRecord& datum : datums_[device]) {
    if (!axis.datum || datum.number != axis.datum->number) continue;
    datum.voided_utime = voided.utime;
    datum.void_reason = voided.why;
  }
  axis.datum.reset();
  axis.position.reset();
}

bool DeviceMemory::Apply(const std::string& device, const DeviceChange& change) {
  AxisRecord& axis = axes_[device];
  const auto apply = [&](const auto& one) {
    using Kind = std::decay_t<decltype(one)>;
    if constexpr (std::is_same_v<Kind, DatumRecord>) {
      SetDatum(device, one);
    } else if constexpr (std::is_same_v<Kind, DatumVoided>) {
      VoidDatum(device, one);
    } else if constexpr (std::is_same_v<Kind, WritesAdded>) {
      axis.writes = std::max<std::int64_t>(axis.writes + one.writes, 0);
      if (axis.since_utime == 0) axis.since_utime = one.utime;
    } else if constexpr (std::is_same_v<Kind, ReferenceChanged>) {
      axis.reference_lost = one.lost;
    } else if constexpr (std::is_same_v<Kind, IdentityChanged>) {
      axis.identity = one.identity;
    } else if constexpr (std::is_same_v<Kind, EncoderExchanged>) {
      VoidDatum(device, {one.utime, kExchangedReason});
      axis = {.identity = one.identity, .since_utime = one.utime};
    } else if constexpr (std::is_same_v<Kind, AlarmMark>) {
      marks_[{device, one.kind, one.alarm}] = one;
    } else {
      marks_.erase({device, one.kind, one.alarm});
    }
  };
  std::visit(apply, change);
  return true;
}

std::vector<DatumRecord> DeviceMemory::Datums(const std::string& device) const {
  const auto found = datums_.find(device);
  return found == datums_.end() ? std::vector<DatumRecord>{} : found->second;
}

std::vector<AlarmMark> DeviceMemory::Marks(const std::string& device) const {
  std::vector<AlarmMark> found;
  for (const auto& [key, mark] : marks_) {
    if (std::get<0>(key) == device) found.push_back(mark);
  }
  return found;
}

bool DeviceStore::Apply(const std::string& device, const DeviceChange& change) {
  if (!Alters(change, memory_.Find(device))) return true;
  if (queue_.IsFull() || !memory_.Apply(device, change)) return false;
  queue_.Keep([=](DurableStore& store) { return store.Apply(device, change); }, now_.mono);
  if (DropsPosition(change)) positions_.erase(device);
  return true;
}

void DeviceStore::KeepPosition(const std::string& device, const LastPosition& position) {
  memory_.KeepPosition(device, position);
  positions_[device] = position;
}

void DeviceStore::Note(const AxisEvent& event) {
  if (queue_.IsHalfFull()) return;
  queue_.Give([event](DurableStore& store) { return store.Note(event), true; }, nullptr, now_.mono);
}

}  // namespace axlecast
