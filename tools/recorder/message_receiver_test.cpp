#include "tools/recorder/message_receiver.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <string>
#include <thread>
#include "tools/recorder/recorder_fixture.h"

namespace axlecast {
namespace {

SenderAddress Sender(std::uint32_t number) { return SenderAddress::OfIPv4(number, 0); }

TEST(OverflowTally, CountsTheSendersThatCameFirstHoweverManyAreInvented) {
  OverflowTally tally;
  tally.On(Sender(7));
  for (std::uint32_t number = 100; number < 100'000; ++number) tally.On(Sender(number));
  tally.On(Sender(7));
  EXPECT_EQ(tally.senders(), UdpmReceiver::kMaxSenders);
  EXPECT_EQ(tally.Of(Sender(7)), 2);
  EXPECT_EQ(tally.Of(Sender(99'999)), 0);
}

bool IsReadable(const MessageQueue& queue, int timeout_ms = 0) {
  pollfd file{queue.FileDescriptor(), POLLIN, 0};
  return poll(&file, 1, timeout_ms) == 1;
}

TEST(MessageQueue, GivesAllInOrder) {
  MessageQueue queue(1 << 20);
  EXPECT_FALSE(IsReadable(queue));
  EXPECT_TRUE(queue.Add(MessageOf("A", "one", 1)));
  EXPECT_TRUE(queue.Add(MessageOf("B", "", 2)));
  EXPECT_TRUE(IsReadable(queue));
  MessageBatch batch;
  ASSERT_TRUE(queue.Take(batch));
  EXPECT_FALSE(IsReadable(queue));
  EXPECT_EQ(batch.left(), 2);
  const auto first = batch.Next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->utime, 1);
  EXPECT_EQ(first->channel, "A");
  EXPECT_EQ(std::string(first->data.begin(), first->data.end()), "one");
  EXPECT_EQ(batch.Next()->channel, "B");
  EXPECT_FALSE(batch.Next());
  ASSERT_TRUE(queue.Take(batch));
  EXPECT_EQ(batch.left(), 0);
}

TEST(MessageQueue, RefusesWhatDoesNotFitAndTakesSmallerOnes) {
  MessageQueue queue(1'000);
  EXPECT_FALSE(queue.Add(MessageOf("A", std::string(1'001, 'x'), 0)));
  int taken = 0;
  while (queue.Add(MessageOf("A", std::string(100, 'x'), 0))) ++taken;
  EXPECT_GT(taken, 6);
  EXPECT_LT(taken, 10);
  MessageBatch batch;
  ASSERT_TRUE(queue.Take(batch));
  EXPECT_EQ(batch.left(), taken);
  EXPECT_TRUE(queue.Add(MessageOf("A", std::string(100, 'x'), 0))) << "there is room again";
}

TEST(MessageQueue, IsOverWhenItIsClosedAndEmpty) {
  MessageQueue queue(1'000);
  MessageBatch batch;
  EXPECT_TRUE(queue.Add(MessageOf("A", "last", 0)));
  queue.Close();
  EXPECT_TRUE(queue.Take(batch));
  EXPECT_EQ(batch.left(), 1);
  EXPECT_FALSE(queue.Take(batch));
}

TEST(MessageQueue, LosesNothingBetweenTwoThreads) {
  MessageQueue queue(64 << 20);
  constexpr int kMessages = 200'000;
  std::thread writer([&] {
    for (int i = 0; i < kMessages; ++i) EXPECT_TRUE(queue.Add(MessageOf("A", std::to_string(i), i)));
    queue.Close();
  });
  MessageBatch batch;
  int next = 0;
  for (bool open = true; open;) {
    ASSERT_TRUE(IsReadable(queue, 10'000));
    open = queue.Take(batch);
    while (const auto message = batch.Next()) {
      ASSERT_EQ(message->utime, next);
      ++next;
    }
  }
  writer.join();
  EXPECT_EQ(next, kMessages);
}

}  // namespace
}  // namespace axlecast
