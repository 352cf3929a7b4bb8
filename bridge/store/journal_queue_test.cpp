#include "bridge/store/journal_queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/memory_store_fixture.h"
#include "bridge/store/store_fixture.h"
#include "core/command/commands.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

using JournalThreadTest = StoreTest;

void WaitFor(JournalThread& thread, std::size_t count) {
  for (std::size_t finished = 0; finished < count; finished += thread.TakeFinished()) std::this_thread::yield();
}

TEST_F(JournalThreadTest, RunsWorkInOrderAndItsResultsCanBeRead) {
  JournalThread thread([this] { return OpenStore(); });
  std::vector<int> order;
  for (int i = 0; i < 1'000; ++i) thread.Run([&order, i](DurableStore&) { order.push_back(i); });
  WaitFor(thread, 1'000);
  ASSERT_EQ(order.size(), 1'000u);
  for (int i = 0; i < 1'000; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

bool IsReadable(const JournalThread& thread, int timeout_ms) {
  pollfd readable{thread.FileDescriptor(), POLLIN, 0};
  return poll(&readable, 1, timeout_ms) == 1;
}

TEST_F(JournalThreadTest, IsWokenByWorkAndByItsEnd) {
  JournalThread thread([this] { return OpenStore(); });
  for (int i = 0; i < 3; ++i) {
    thread.Run([](DurableStore&) {});
    WaitFor(thread, 1);  // from then on it waits
  }
  EXPECT_FALSE(thread.ended());
  thread.Finish();
  while (!thread.ended()) std::this_thread::yield();
}

TEST_F(JournalThreadTest, CountsAllThatHasFinishedSinceTheLastTime) {
  JournalThread thread([this] { return OpenStore(); });
  EXPECT_EQ(thread.TakeFinished(), 0U);
  for (int i = 0; i < 2; ++i) thread.Run([](DurableStore&) {});
  thread.Finish();
  while (!thread.ended()) std::this_thread::yield();
  EXPECT_EQ(thread.TakeFinished(), 2U);
  EXPECT_EQ(thread.TakeFinished(), 0U);
}

TEST_F(JournalThreadTest, TheStoreIsClosedWhenItHasEnded) {
  JournalThread thread([this] { return OpenStore(); });
  thread.Run([](DurableStore& store) { store.KeepPosition("axis1", {.counts = 5, .utime = kStart}); });
  thread.Finish();
  while (!thread.ended()) std::this_thread::yield();
  EXPECT_EQ(Ask("SELECT position_counts FROM axes"), "5\n") << "which is written at the end";
}

class ClosingStore final : public MemoryStore {
 public:
  explicit ClosingStore(std::function<void()> closed) : closed_(std::move(closed)) {}
  ~ClosingStore() override { closed_(); }
  ClosingStore(const ClosingStore&) = delete;
  ClosingStore& operator=(const ClosingStore&) = delete;

 private:
  const std::function<void()> closed_;
};

TEST_F(JournalThreadTest, HasNotEndedBeforeItsStoreIsClosed) {
  std::optional<bool> ended;
  JournalThread* self = nullptr;
  {
    JournalThread thread([&] { return std::make_unique<ClosingStore>([&] { ended = self->ended(); }); });
    self = &thread;
  }
  EXPECT_EQ(ended, false);
}

TEST_F(JournalThreadTest, ItsFileTellsThatWorkHasFinished) {
  JournalThread thread([this] { return OpenStore(); });
  EXPECT_FALSE(IsReadable(thread, 0));
  thread.Run([](DurableStore&) {});
  ASSERT_TRUE(IsReadable(thread, -1)) << "without being asked";
  EXPECT_EQ(thread.TakeFinished(), 1u);
  EXPECT_FALSE(IsReadable(thread, 0));
}

TEST_F(JournalThreadTest, ADiskThatDoesNotAnswerHoldsUpNobodyElse) {
  std::mutex mutex;
  std::condition_variable changed;
  bool answers = false;
  JournalThread thread([this] { return OpenStore(); });
  thread.Run([&](DurableStore&) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return answers; });
  });
  thread.Run([](DurableStore&) {});
  EXPECT_EQ(thread.TakeFinished(), 0u);
  thread.Finish();
  EXPECT_FALSE(thread.ended());
  {
    const std::lock_guard lock(mutex);
    answers = true;
  }
  changed.notify_all();
  WaitFor(thread, 2);
}

TEST_F(JournalThreadTest, WhatWasGivenIsRunBeforeItEnds) {
  std::atomic<int> ran = 0;
  {
    JournalThread thread([this] { return OpenStore(); });
    for (int i = 0; i < 100; ++i) thread.Run([&ran](DurableStore&) { ++ran; });
  }
  EXPECT_EQ(ran, 100);
}

// ---- the dispatcher's side ----

// A journal whose disk may stall or fail.
class JournalQueueTest : public ::testing::Test {
 protected:
  // Work that notes its name, and its callback.
  JournalQueue::Work Named(const std::string& name, bool result = true) {
    return [this, name, result](DurableStore&) {
      ran_ += name;
      return result && !store_.fails;
    };
  }
  JournalQueue::Done Told(const std::string& name) {
    return [this, name](bool written) { told_ += name + (written ? "+" : "-"); };
  }

  MemoryStore store_;
  InlineJournal worker_{store_};
  JournalQueue queue_{worker_};
  std::string ran_;
  std::string told_;
};

TEST_F(JournalQueueTest, TellsEachInItsOrderWhenSettled) {
  queue_.Give(Named("a"), Told("a"), 0);
  queue_.Give(Named("b", false), Told("b"), 0);
  queue_.Keep(Named("c"), 0);
  queue_.Ask(Named("d"), Told("d"), 0);
  queue_.Ask(Named("e", false), Told("e"), 0);
  EXPECT_EQ(ran_, "abcde");
  EXPECT_EQ(told_, "");
  queue_.Settle();
  EXPECT_EQ(told_, "a+b-d+e-");
  queue_.Settle();
  EXPECT_EQ(told_, "a+b-d+e-") << "once";
}

TEST_F(JournalQueueTest, WhatIsCalledBackMayGiveMore) {
  queue_.Give(
      Named("a"), [this](bool) { queue_.Give(Named("b"), Told("b"), 0); }, 0);
  queue_.Settle();
  EXPECT_EQ(told_, "b+");
}

TEST_F(JournalQueueTest, OnlyWhatHasFinishedIsSettled) {
  queue_.Give(Named("a"), Told("a"), 0);
  worker_.Stall();
  queue_.Give(Named("b"), Told("b"), 0);
  queue_.Give(Named("c"), Told("c"), 0);
  queue_.Settle();
  EXPECT_EQ(told_, "a+");
  EXPECT_EQ(queue_.Age(kSecond), kSecond);
  worker_.Recover();
  queue_.Settle();
  EXPECT_EQ(told_, "a+b+c+");
}

TEST_F(JournalQueueTest, ADiskThatFailedWhileAskedIsNotWrittenTo) {
  store_.fails = true;
  queue_.Keep(Named("a"), 0);
  ran_.clear();
  queue_.Ask(Named("b"), Told("b"), 0);
  EXPECT_EQ(ran_, "b") << "a waits until the store works";
}

TEST_F(JournalQueueTest, AChangeThatFailedIsTriedAgainBeforeWhatFollows) {
  store_.fails = true;
  queue_.Keep(Named("a"), 0);
  queue_.Keep(Named("b"), 0);
  queue_.Give(Named("c"), Told("c"), 0);
  queue_.Ask(Named("d"), Told("d"), 0);
  EXPECT_EQ(ran_, "aaad") << "b waits for a, and c is not run";
  queue_.Settle();
  EXPECT_EQ(told_, "c-d-");
  store_.fails = false;
  ran_.clear();
  queue_.Ask(Named("e"), Told("e"), 0);
  EXPECT_EQ(ran_, "eab") << "the disk works again";
  queue_.Give(Named("f"), Told("f"), 0);
  EXPECT_EQ(ran_, "eabf");
  queue_.Settle();
  EXPECT_EQ(told_, "c-d-e+f+");
}

TEST_F(JournalQueueTest, TheOldestDecidesHowLongTheDiskHasNotAnswered) {
  EXPECT_EQ(queue_.Age(kSecond), 0);
  worker_.Stall();
  queue_.Give(Named("a"), nullptr, kSecond);
  queue_.Give(Named("b"), nullptr, 2 * kSecond);
  EXPECT_EQ(queue_.Age(3 * kSecond), 2 * kSecond);
  EXPECT_FALSE(queue_.IsSlow(kSecond + JournalQueue::kSlow));
  EXPECT_TRUE(queue_.IsSlow(kSecond + JournalQueue::kSlow + 1));
  EXPECT_FALSE(queue_.IsStalled(kSecond + JournalQueue::kStalled));
  EXPECT_TRUE(queue_.Check(kSecond + JournalQueue::kStalled));
  const MonoNs late = kSecond + 2'390 * kMillisecond;
  EXPECT_TRUE(queue_.IsStalled(late));
  EXPECT_EQ(
      ErrorText(queue_.Check(late)),
      "its disk has not answered for 2.3 s: look at the kernel's log (dmesg) and at what else writes to that disk");
  EXPECT_THAT(ErrorText(queue_.Check(11 * kSecond)), HasSubstr(" for 10.0 s: "));
  worker_.Recover();
  queue_.Settle();
  EXPECT_EQ(queue_.Age(late), 0);
  EXPECT_TRUE(queue_.Check(late));
}

TEST_F(JournalQueueTest, IsFullOfAThousandPieces) {
  worker_.Stall();
  const auto fill = [this](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) queue_.Give(Named(""), nullptr, 0);
  };
  fill(JournalQueue::kMaxWaiting / 2 - 1);
  EXPECT_FALSE(queue_.IsHalfFull());
  fill(1);
  EXPECT_TRUE(queue_.IsHalfFull());
  fill(JournalQueue::kMaxWaiting / 2 - 1);
  EXPECT_FALSE(queue_.IsFull());
  fill(1);
  EXPECT_TRUE(queue_.IsFull());
  EXPECT_EQ(ErrorText(queue_.Check(0)),
            "1000 changes wait to be written: its disk is too slow (iostat -x), or has failed");
  fill(JournalQueue::kMaxWaiting - 1);
  EXPECT_FALSE(queue_.IsOverfull());
  fill(1);
  EXPECT_TRUE(queue_.IsOverfull());
  worker_.Recover();
  queue_.Settle();
  EXPECT_FALSE(queue_.IsHalfFull());
}

TEST_F(JournalQueueTest, ChangesThatCannotBeWrittenFillItToo) {
  store_.fails = true;
  for (std::size_t i = 0; i + 1 < JournalQueue::kMaxWaiting; ++i) queue_.Keep(Named(""), 0);
  queue_.Settle();
  EXPECT_FALSE(queue_.IsFull());
  EXPECT_EQ(ErrorText(queue_.Check(0)), "the disk is full") << "what the store reports";
  queue_.Keep(Named(""), 0);
  EXPECT_TRUE(queue_.IsFull());
  queue_.Settle();
  EXPECT_TRUE(queue_.IsFull());
}

// ---- records of devices in memory ----

// Everything that a store holds of a device, as text.
std::string All(const DeviceRecords& store, const std::string& device) {
  const AxisRecord axis = store.Find(device);
  std::ostringstream text;
  const auto add = [&text](const DatumRecord& datum) {
    text << " datum " << datum.number << ',' << datum.counts << ',' << datum.utime << ',' << datum.identity << ','
         << datum.value << ',' << datum.who << ',' << IdText(datum.command) << ',' << datum.reason << ','
         << datum.voided_utime << ',' << datum.void_reason;
  };
  text << axis.identity << (axis.reference_lost ? " lost " : " holds ") << axis.writes << ' ' << axis.since_utime;
  if (axis.position) text << " at " << axis.position->counts << ',' << axis.position->utime;
  if (axis.datum) add(*axis.datum);
  text << " all:";
  for (const DatumRecord& datum : store.Datums(device)) add(datum);
  for (const AlarmMark& mark : store.Marks(device)) {
    text << " mark " << static_cast<int>(mark.kind) << ',' << mark.alarm << ',' << mark.utime << ','
         << mark.until_utime << ',' << mark.up_to << ',' << mark.who << ',' << mark.reason << ','
         << IdText(mark.command) << ',' << mark.driver_boot_id << ',' << mark.known_utime;
  }
  return text.str();
}

const std::vector<std::pair<std::string, DeviceChange>>& Changes() {
  using Kind = AlarmMark::Kind;
  const auto mark = [](Kind kind, const std::string& alarm, std::int64_t boot) {
    return AlarmMark{kind, alarm, 1, 2, "error", "anna", "known", NumberedId(3), boot, 5};
  };
  static const std::vector<std::pair<std::string, DeviceChange>> kChanges = {
      {"a", WritesAdded{3, 10}},
      {"a", WritesAdded{-1, 20}},
      {"a", WritesAdded{-5, 30}},
      {"a", WritesAdded{7, 40}},
      {"a", ReferenceChanged{true}},
      {"b", ReferenceChanged{false}},
      {"a", IdentityChanged{"17"}},
      {"a", DatumRecord{.counts = 4, .utime = 50, .identity = "17", .value = "1 m", .who = "anna", .reason = "x"}},
      {"b", DatumRecord{.counts = 5, .command = NumberedId(9), .voided_utime = 8, .void_reason = "not of now"}},
      {"a", DatumRecord{.counts = 6}},
      {"b", DatumVoided{60, "home"}},
      {"b", DatumVoided{70, "no datum is in force"}},
      {"b", DatumRecord{.counts = 7}},
      {"a", mark(Kind::kShelved, "x", 4)},
      {"a", mark(Kind::kAcknowledged, "y", 4)},
      {"a", mark(Kind::kAcknowledged, "x", 4)},
      {"b", mark(Kind::kShelved, "x", 4)},
      {"a", mark(Kind::kShelved, "x", 6)},
      {"a", AlarmMarkEnded{Kind::kAcknowledged, "x"}},
      {"a", AlarmMarkEnded{Kind::kShelved, "none"}},
      {"a", EncoderExchanged{"18", 80}},
      {"a", DatumRecord{.counts = 8}},
  };
  return kChanges;
}

using DeviceMemoryTest = StoreTest;

TEST_F(DeviceMemoryTest, HoldsAfterEachChangeWhatTheJournalHolds) {
  const auto store = OpenStore();
  DeviceMemory memory;
  int number = 0;
  for (const auto& [device, change] : Changes()) {
    store->KeepPosition(device, {number, 1'000 + number});
    memory.KeepPosition(device, {number, 1'000 + number});
    ASSERT_TRUE(store->Apply(device, change));
    ASSERT_TRUE(memory.Apply(device, change));
    for (const char* each : {"a", "b", "c"}) EXPECT_EQ(All(memory, each), All(*store, each)) << "change " << number;
    ++number;
  }
}

TEST_F(DeviceMemoryTest, IsLoadedFromTheJournal) {
  const auto store = OpenStore();
  for (const auto& [device, change] : Changes()) ASSERT_TRUE(store->Apply(device, change));
  store->KeepPosition("b", {11, 12});
  DeviceMemory memory;
  for (const char* device : {"a", "b"}) memory.Load(device, *store);
  for (const char* device : {"a", "b"}) EXPECT_EQ(All(memory, device), All(*store, device));
  ASSERT_TRUE(store->Apply("a", DatumRecord{.counts = 1}));
  ASSERT_TRUE(memory.Apply("a", DatumRecord{.counts = 1}));
  EXPECT_EQ(All(memory, "a"), All(*store, "a")) << "numbers continue";
}

// ---- what the dispatcher keeps of devices ----

class DeviceStoreTest : public JournalQueueTest {
 protected:
  Timestamp now_{kSecond, 1};
  DeviceStore devices_{queue_, now_};
};

TEST_F(DeviceStoreTest, AChangeIsKnownAtOnceAndWrittenInOrder) {
  worker_.Stall();
  EXPECT_TRUE(devices_.Apply("a", IdentityChanged{"17"}));
  EXPECT_TRUE(devices_.Apply("a", IdentityChanged{"18"}));
  EXPECT_EQ(devices_.Find("a").identity, "18");
  EXPECT_EQ(store_.Find("a").identity, "");
  EXPECT_EQ(queue_.Age(3 * kSecond), 2 * kSecond);
  worker_.Recover();
  EXPECT_EQ(store_.Find("a").identity, "18");
}

TEST_F(DeviceStoreTest, WhatChangesNothingIsNotWritten) {
  worker_.Stall();
  EXPECT_TRUE(devices_.Apply("a", ReferenceChanged{false}));
  EXPECT_EQ(worker_.waiting(), 0U);
  EXPECT_TRUE(devices_.Apply("a", ReferenceChanged{true}));
  EXPECT_EQ(worker_.waiting(), 1U);
}

TEST_F(DeviceStoreTest, AFullQueueTakesNoChange) {
  worker_.Stall();
  for (std::size_t i = 0; i < JournalQueue::kMaxWaiting; ++i) queue_.Give(Named(""), nullptr, 0);
  EXPECT_FALSE(devices_.Apply("a", IdentityChanged{"17"}));
  EXPECT_EQ(devices_.Find("a").identity, "");
  EXPECT_TRUE(devices_.Apply("a", ReferenceChanged{false})) << "it is so already";
}

TEST_F(DeviceStoreTest, PositionsWaitForTheNextTick) {
  devices_.KeepPosition("a", {1, 2});
  devices_.KeepPosition("a", {3, 4});
  devices_.KeepPosition("b", {5, 6});
  EXPECT_EQ(devices_.Find("a").position->counts, 3);
  EXPECT_TRUE(devices_.Apply("b", DatumVoided{7, "home"}));
  EXPECT_FALSE(devices_.Find("b").position);
  EXPECT_TRUE(devices_.Apply("a", IdentityChanged{"17"}));
  const auto positions = devices_.TakePositions();
  ASSERT_EQ(positions.size(), 1U) << "that of b was counted from another origin";
  EXPECT_EQ(positions.at("a").counts, 3);
  EXPECT_EQ(positions.at("a").utime, 4);
  EXPECT_TRUE(devices_.TakePositions().empty());
}

TEST_F(DeviceStoreTest, EventsLeaveHalfOfTheRoomToCommands) {
  devices_.Note({1, "a", "reference_lost", "text"});
  ASSERT_EQ(store_.events.size(), 1U);
  EXPECT_EQ(store_.events[0].kind, "reference_lost");
  worker_.Stall();
  for (std::size_t i = 1; i < JournalQueue::kMaxWaiting / 2; ++i) queue_.Give(Named(""), nullptr, 0);
  const std::size_t waiting = worker_.waiting();
  devices_.Note({1, "a", "reference_lost", "text"});
  EXPECT_EQ(worker_.waiting(), waiting);
}

}  // namespace

}  // namespace axlecast
