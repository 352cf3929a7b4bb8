#include "bridge/store/journal_queue.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <vector>

#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

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

}  // namespace

}  // namespace axlecast
