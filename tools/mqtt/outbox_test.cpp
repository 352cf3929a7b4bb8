#include "tools/mqtt/outbox.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <thread>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;

constexpr std::size_t kRoom = 1 << 20;

void Put(Outbox& outbox, RetentionClass keeping, const std::string& topic, const std::string& payload) {
  outbox.Put({topic, payload, keeping == RetentionClass::kNewest}, keeping);
}

// All that waits; it is on its way then.
std::vector<std::string> TakeAll(Outbox& outbox) {
  std::vector<std::string> payloads;
  while (auto next = outbox.Take()) payloads.push_back(next->message.payload);
  return payloads;
}

TEST(Outbox, GivesWhatWasPutInItsOrder) {
  Outbox outbox({10, kRoom});
  Put(outbox, RetentionClass::kSamples, "position", "p1");
  Put(outbox, RetentionClass::kNewest, "alarm", "a1");
  Put(outbox, RetentionClass::kEvents, "trip", "t1");
  Put(outbox, RetentionClass::kSamples, "position", "p2");
  EXPECT_THAT(TakeAll(outbox), ElementsAre("p1", "a1", "t1", "p2"));
}

TEST(Outbox, OfAStateTheNewestStaysInItsOwnPlace) {
  Outbox outbox({10, kRoom});
  Put(outbox, RetentionClass::kNewest, "alarm", "a1");
  Put(outbox, RetentionClass::kEvents, "trip", "t1");
  Put(outbox, RetentionClass::kNewest, "alarm", "a2");
  Put(outbox, RetentionClass::kNewest, "device", "d1");
  EXPECT_EQ(outbox.counts().messages, 3);
  EXPECT_EQ(outbox.counts().replaced, 1);
  EXPECT_THAT(TakeAll(outbox), ElementsAre("t1", "a2", "d1"));
  EXPECT_EQ(outbox.counts().Lost(), 0);
}

TEST(Outbox, ShedsTheOldestSampleThenTheOldestEventThenTheOldestState) {
  Outbox outbox({4, kRoom});
  Put(outbox, RetentionClass::kNewest, "alarm", "a1");
  Put(outbox, RetentionClass::kEvents, "trip", "t1");
  Put(outbox, RetentionClass::kSamples, "position", "p1");
  Put(outbox, RetentionClass::kSamples, "position", "p2");
  Put(outbox, RetentionClass::kSamples, "position", "p3");
  EXPECT_THAT(outbox.counts().shed, ElementsAre(0, 0, 1));
  Put(outbox, RetentionClass::kEvents, "trip", "t2");
  Put(outbox, RetentionClass::kEvents, "trip", "t3");
  Put(outbox, RetentionClass::kEvents, "trip", "t4");
  EXPECT_THAT(outbox.counts().shed, ElementsAre(0, 1, 3));
  for (const char* topic : {"d1", "d2", "d3", "d4"}) Put(outbox, RetentionClass::kNewest, topic, topic);
  EXPECT_THAT(outbox.counts().shed, ElementsAre(1, 4, 3));
  EXPECT_EQ(outbox.counts().Lost(), 8);
  EXPECT_THAT(TakeAll(outbox), ElementsAre("d1", "d2", "d3", "d4"));
}

TEST(Outbox, IsBoundedInBytes) {
  Outbox outbox({1'000, 10'000});
  for (int i = 0; i < 100; ++i) Put(outbox, RetentionClass::kSamples, "p", std::string(1'000, 'x'));
  EXPECT_LE(outbox.counts().bytes, 10'000);
  EXPECT_EQ(outbox.counts().messages + outbox.counts().shed[2], 100);
  EXPECT_GE(outbox.counts().messages, 8);
  Put(outbox, RetentionClass::kNewest, "alarm", std::string(20'000, 'x'));
  EXPECT_EQ(outbox.counts().shed[0], 1) << "what never fits is counted as well";
}

TEST(Outbox, WhatIsOnItsWayIsNotShedAndComesAgain) {
  Outbox outbox({2, kRoom});
  Put(outbox, RetentionClass::kSamples, "p", "p1");
  Put(outbox, RetentionClass::kSamples, "p", "p2");
  const auto first = outbox.Take();
  const auto second = outbox.Take();
  ASSERT_TRUE(first && second);
  Put(outbox, RetentionClass::kSamples, "p", "p3");
  EXPECT_THAT(outbox.counts().shed, ElementsAre(0, 0, 1)) << "there is no room: the newest goes";
  outbox.Confirm(first->id);
  Put(outbox, RetentionClass::kSamples, "p", "p4");
  outbox.Return();
  EXPECT_THAT(TakeAll(outbox), ElementsAre("p2", "p4"));
  EXPECT_EQ(outbox.counts().taken, 1);
}

TEST(Outbox, AReturnedStateGivesWayToANewerOne) {
  Outbox outbox({10, kRoom});
  Put(outbox, RetentionClass::kNewest, "alarm", "a1");
  ASSERT_TRUE(outbox.Take());
  Put(outbox, RetentionClass::kNewest, "alarm", "a2");
  EXPECT_EQ(outbox.counts().replaced, 0) << "the older is on its way";
  outbox.Return();
  EXPECT_EQ(outbox.counts().replaced, 1);
  EXPECT_THAT(TakeAll(outbox), ElementsAre("a2"));
  outbox.Return();
  Put(outbox, RetentionClass::kNewest, "alarm", "a3");
  EXPECT_THAT(TakeAll(outbox), ElementsAre("a3"));
}

TEST(Outbox, CountsWhatIsRefused) {
  Outbox outbox({10, kRoom});
  Put(outbox, RetentionClass::kEvents, "trip", "t1");
  const auto next = outbox.Take();
  ASSERT_TRUE(next);
  outbox.Refuse(next->id);
  outbox.Refuse(next->id);
  outbox.Confirm(77);
  EXPECT_EQ(outbox.counts().refused, 1);
  EXPECT_EQ(outbox.counts().messages, 0);
  EXPECT_EQ(outbox.counts().bytes, 0);
}

TEST(Outbox, IsReadableWhileSomethingWaits) {
  Outbox outbox({10, kRoom});
  pollfd file{outbox.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&file, 1, 0), 0);
  Put(outbox, RetentionClass::kEvents, "trip", "t1");
  EXPECT_EQ(poll(&file, 1, 0), 1);
  EXPECT_THAT(TakeAll(outbox), ElementsAre("t1"));
  EXPECT_EQ(poll(&file, 1, 0), 0);
  outbox.Return();
  EXPECT_EQ(poll(&file, 1, 0), 1);
}

TEST(Outbox, OneThreadPutsWhileAnotherTakes) {
  constexpr int kMessages = 5'000;
  Outbox outbox({50, kRoom});
  std::thread putting([&outbox] {
    for (int i = 0; i < kMessages; ++i) Put(outbox, RetentionClass::kEvents, "trip", std::to_string(i));
  });
  std::int64_t taken = 0;
  int newest = -1;
  while (taken + outbox.counts().Lost() < kMessages) {
    const auto next = outbox.Take();
    if (!next) continue;
    EXPECT_GT(std::stoi(next->message.payload), newest);
    newest = std::stoi(next->message.payload);
    outbox.Confirm(next->id);
    ++taken;
  }
  putting.join();
  EXPECT_EQ(outbox.counts().taken, taken);
}

}  // namespace
}  // namespace axlecast
