#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "bridge/store/durable_store.h"
#include "core/base/time.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Runs work on the durable store, so that a disk that does not answer holds up nobody else. The work runs in the order
// in which it was given, one at a time.
class JournalWorker {
 public:
  using Work = std::function<void(DurableStore& store)>;

  virtual ~JournalWorker() = default;

  // Returns at once. `work` may run in another thread; what it writes may be read when TakeFinished has counted it.
  virtual void Run(Work work) = 0;
  // How many pieces of work have ended since the last call.
  [[nodiscard]] virtual std::size_t TakeFinished() = 0;
};

// The dispatcher's side of the journal: gives work to the journal's thread and calls back when it is done. Never waits.
// One thread.
class JournalQueue {
 public:
  static constexpr std::size_t kMaxWaiting = 1'000;   // pieces of work, and changes that could not be written yet
  static constexpr MonoNs kSlow = 50 * kMillisecond;  // the oldest waits longer: urgent commands and reads pass it
  static constexpr MonoNs kStalled = kSecond;         // the oldest waits longer: commands are refused

  // What is to be made durable; false when it could not be.
  using Work = std::function<bool(DurableStore& store)>;
  using Done = std::function<void(bool written)>;

  explicit JournalQueue(JournalWorker& worker) : worker_(worker) {}

  // Runs `work` after everything that was given before. It fails, and is not run, while a change that was given before
  // it could not be written. Settle calls `done`.
  void Give(Work work, Done done, MonoNs now);
  // The same for a change that must reach the disk in the end: one that fails is tried again, in the same order.
  void Keep(Work work, MonoNs now);
  // Runs `work` whatever came of what was given before, and calls `done` with what it returns.
  void Ask(Work work, Done done, MonoNs now);

  // Calls back for work that is done. What is called may give more.
  void Settle();

  // How long the oldest work has waited; 0 when none waits.
  [[nodiscard]] MonoNs Age(MonoNs now) const;
  [[nodiscard]] bool IsSlow(MonoNs now) const { return Age(now) > kSlow; }
  [[nodiscard]] bool IsStalled(MonoNs now) const { return Age(now) > kStalled; }
  [[nodiscard]] bool IsFull() const;
  // Outcomes may fill twice the room, because they can no longer be refused. Further outcomes are published but not written.
  [[nodiscard]] bool IsOverfull() const { return pending_.size() >= 2 * kMaxWaiting; }
  // Less important work (progress, events) leaves the other half of the room to commands.
  [[nodiscard]] bool IsHalfFull() const { return pending_.size() >= kMaxWaiting / 2; }
  // Fails while nothing can be made durable: the error is the cause and the fix.
  [[nodiscard]] Result<> Check(MonoNs now) const;

 private:
  // What a piece of work leaves for the caller's thread.
  struct Finished {
    bool written = false;
    Result<> store_state;
    std::size_t unwritten = 0;
  };
  struct Pending {
    std::shared_ptr<const Finished> finished;
    Done done;
    MonoNs given;
  };
  // Changes that could not be written yet, oldest first. Touched by work only.
  using Backlog = std::deque<Work>;

  static bool WriteBacklog(Backlog& backlog, DurableStore& store);
  void Run(std::function<bool(DurableStore&, Backlog&)> work, Done done, MonoNs now);

  JournalWorker& worker_;
  std::deque<Pending> pending_;
  const std::shared_ptr<Backlog> backlog_ = std::make_shared<Backlog>();
  Result<> store_state_;
  std::size_t unwritten_ = 0;
};

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

// Records of devices in memory, by the same rules as the journal's tables. Every change succeeds.
class DeviceMemory final : public DeviceRecords {
 public:
  // Copies all that `store` (the journal) holds of a device.
  void Load(const std::string& device, const DeviceRecords& store);

  [[nodiscard]] bool Apply(const std::string& device, const DeviceChange& change) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    axes_[device].position = position;
  }
  void Note(const AxisEvent& /*event*/) override {}
  [[nodiscard]] AxisRecord Find(const std::string& device) const override;
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override;
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override;

 private:
  void SetDatum(const std::string& device, const DatumRecord& datum);
  void VoidDatum(const std::string& device, const DatumVoided& voided);

  std::map<std::string, AxisRecord> axes_;
  std::map<std::string, std::vector<DatumRecord>> datums_;  // newest first
  std::int64_t newest_ = 0;                                 // number of the newest datum of all
  std::map<std::tuple<std::string, AlarmMark::Kind, std::string>, AlarmMark> marks_;
};

// Records of devices for the dispatcher, answered from memory and written by the journal's thread. Apply returns true if
// the change is kept and will be written, in order, as soon as possible. It returns false and changes nothing if too many
// changes wait already. What must be durable first waits for a later Give of the same queue.
class DeviceStore final : public DeviceRecords {
 public:
  // `now`: time of the present call; it must outlive the store, like `queue`.
  DeviceStore(JournalQueue& queue, const Timestamp& now) : queue_(queue), now_(now) {}

  void Load(DeviceMemory memory) { memory_ = std::move(memory); }
  // Returns the positions that were kept since the last call, to be written with the next Tick of the journal.
  [[nodiscard]] std::map<std::string, LastPosition> TakePositions() { return std::exchange(positions_, {}); }

  [[nodiscard]] bool Apply(const std::string& device, const DeviceChange& change) override;
  void KeepPosition(const std::string& device, const LastPosition& position) override;
  void Note(const AxisEvent& event) override;
  [[nodiscard]] AxisRecord Find(const std::string& device) const override { return memory_.Find(device); }
  [[nodiscard]] std::vector<DatumRecord> Datums(const std::string& device) const override {
    return memory_.Datums(device);
  }
  [[nodiscard]] std::vector<AlarmMark> Marks(const std::string& device) const override {
    return memory_.Marks(device);
  }

 private:
  JournalQueue& queue_;
  DeviceMemory memory_;
  std::map<std::string, LastPosition> positions_;
  const Timestamp& now_;
};

}  // namespace axlecast
