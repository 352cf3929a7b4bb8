#include "tools/recorder/message_receiver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/timerfd.h>
#include <axlecast/bus_health_t.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "platform/os/system_clock.h"
#include "tests/support/fake_clock.h"
#include "tests/support/temporary_folder.h"
#include "tools/recorder/recorder_fixture.h"
#include "tools/recorder/source_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

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

TEST(MessageQueue, ItsLimitCountsTheBytesOfChannelsAndDataBesidesThoseThatWait) {
  MessageQueue empty(8);
  EXPECT_FALSE(empty.Add(MessageOf("AB", "1234567", 0)));
  EXPECT_TRUE(empty.Add(MessageOf("AB", "123456", 0)));
  MessageBatch batch;
  batch.Add(MessageOf("AB", "123456", 0));
  MessageQueue queue(batch.bytes() + 8);
  ASSERT_TRUE(queue.Add(MessageOf("AB", "123456", 0)));
  EXPECT_FALSE(queue.Add(MessageOf("AB", "1234567", 0)));
  EXPECT_TRUE(queue.Add(MessageOf("AB", "123456", 0)));
}

TEST(MessageQueue, ItsFileIsReadableForTheFirstMessageOfEachBatch) {
  MessageQueue queue(1'000);
  MessageBatch batch;
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(queue.Add(MessageOf("A", "1", 0)));
    EXPECT_TRUE(IsReadable(queue));
    ASSERT_TRUE(queue.Take(batch));
    EXPECT_FALSE(IsReadable(queue));
  }
}

TEST(MessageQueue, ItsFileStaysReadableAfterItsEnd) {
  MessageQueue queue(1'000);
  queue.Close();
  EXPECT_TRUE(IsReadable(queue));
  MessageBatch batch;
  EXPECT_FALSE(queue.Take(batch));
  EXPECT_TRUE(IsReadable(queue));
}

TEST(MessageQueue, ABatchThatWasNotReadIsReplaced) {
  MessageQueue queue(1'000);
  MessageBatch batch;
  for (const char* text : {"1", "2", "3"}) {
    EXPECT_TRUE(queue.Add(MessageOf("A", text, 0)));
    ASSERT_TRUE(queue.Take(batch));
    EXPECT_EQ(batch.left(), 1);
  }
  EXPECT_EQ(AsText(batch.Next()->data), "3");
  EXPECT_TRUE(queue.Take(batch));
  EXPECT_EQ(batch.left(), 0);
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

// Readable after `ms`.
Descriptor Timer(int ms) {
  Descriptor timer(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC));
  const itimerspec once{{0, 0}, {0, ms * 1'000'000}};
  EXPECT_EQ(timerfd_settime(timer.get(), 0, &once, nullptr), 0);
  return timer;
}

class MessageReceiverTest : public ::testing::Test {
 protected:
  // A reception that does not end is a failure, which ends the program.
  void SetUp() override { alarm(kPatienceSeconds); }
  void TearDown() override { alarm(0); }

  MessageReceiver& Make(const ChannelFilter& filter = {}, const std::string& machine = "",
                        std::size_t queue = 1 << 20) {
    queue_.emplace(queue);
    return receiver_.emplace(filter, machine, *queue_, clock_);
  }
  MessageReceiver& Listening(const std::string& options = "", std::size_t queue = 1 << 20) {
    MessageReceiver& receiver = Make({}, "", queue);
    const Result<> listening = receiver.Listen(group_.Url(options));
    EXPECT_TRUE(listening) << ErrorText(listening);
    return receiver;
  }
  // Receives what has arrived.
  void Receive() {
    const WakeEvent stop;
    stop.Set();
    const Result<> received = receiver_->Run(stop.FileDescriptor());
    EXPECT_TRUE(received) << ErrorText(received);
  }
  // "CHANNEL=data" of the messages in the queue.
  std::vector<std::string> Taken() {
    MessageBatch batch;
    static_cast<void>(queue_->Take(batch));
    std::vector<std::string> messages;
    while (const auto message = batch.Next()) {
      messages.push_back(std::string(message->channel) + '=' + std::string(AsText(message->data)));
      utimes_.push_back(message->utime);
    }
    return messages;
  }
  [[nodiscard]] std::string Source(const std::vector<LogEvent>& events) const {
    return WriteSource(folder_.path() + "/source.lcm", events);
  }

  SystemClock system_clock_;
  FakeClock clock_{kSecond};
  TestGroup group_;
  TestSender sender_{group_};
  TemporaryFolder folder_;
  std::optional<MessageQueue> queue_;
  std::optional<MessageReceiver> receiver_;
  std::vector<std::int64_t> utimes_;
};

TEST_F(MessageReceiverTest, ReceivesInOrderWithTheTimesOfTheKernel) {
  MessageReceiver& receiver = Listening();
  EXPECT_THAT(receiver.warnings(), IsEmpty());
  const std::int64_t before = system_clock_.UtcMicroseconds();
  sender_.Send("A", "one");
  sender_.Send("B", "");
  Receive();
  EXPECT_THAT(Taken(), ElementsAre("A=one", "B="));
  for (const std::int64_t utime : utimes_) {
    EXPECT_GE(utime, before - 1);
    EXPECT_LE(utime, system_clock_.UtcMicroseconds() + 1);
  }
  const ReceiverCounts counts = receiver.counts();
  EXPECT_EQ(counts.received, 2);
  EXPECT_EQ(counts.lost, 0);
  EXPECT_EQ(counts.not_lcm, 0);
  EXPECT_EQ(counts.overflow, 0);
  EXPECT_EQ(counts.network, "");
  ASSERT_THAT(counts.senders, SizeIs(1));
  EXPECT_EQ(counts.senders[0].received, 2);
  EXPECT_EQ(receiver.iterations(), 1U);
}

// With this clock, nothing ends the wait but a file that is readable.
TEST_F(MessageReceiverTest, AMessageEndsTheWait) {
  clock_.MoveTo(kNever - 100 * kMillisecond);
  for (const bool by_lcm : {false, true}) {
    MessageReceiver& receiver = by_lcm ? Make() : Listening();
    if (by_lcm) {
      ASSERT_TRUE(receiver.Listen(Source({MessageOf("A", "1", 0), MessageOf("A", "2", kMuchLater)})));
    } else {
      sender_.Send("A", "1");
    }
    EXPECT_TRUE(receiver.Run(queue_->FileDescriptor()));
    EXPECT_THAT(Taken(), ElementsAre("A=1"));
  }
}

TEST_F(MessageReceiverTest, LooksAtItsSourcesTenTimesASecondUntilTheStop) {
  MessageReceiver& receiver = Listening();
  sender_.Send("A", "1");
  const Descriptor stop = Timer(150);
  EXPECT_TRUE(receiver.Run(stop.get()));
  EXPECT_GE(receiver.iterations(), 2U);
  EXPECT_LE(receiver.iterations(), 10U);
  EXPECT_EQ(receiver.counts().received, 1);
}

TEST_F(MessageReceiverTest, CountsTheLossesOfEachSenderGreatestFirst) {
  const TestGroup other_group(1);
  MessageReceiver& receiver = Listening();
  ASSERT_TRUE(receiver.Listen(other_group.Url()));
  TestSender second(group_);
  TestSender third(other_group);
  TestSender fourth(other_group);
  for (TestSender* sender : {&sender_, &second, &third, &fourth}) sender->Send("A", "begin");
  sender_.Send("A", "end", 1);
  second.Send("A", "end", 2);
  third.Send("A", "end", 7);
  fourth.Send("A", "end", 2);
  Receive();
  const ReceiverCounts counts = receiver.counts();
  EXPECT_EQ(counts.received, 8);
  EXPECT_EQ(counts.lost, 12);
  ASSERT_THAT(counts.senders, SizeIs(4));
  EXPECT_EQ(counts.senders[0].lost, 7);
  EXPECT_EQ(counts.senders[1].lost, 2);
  EXPECT_EQ(counts.senders[2].lost, 2);
  EXPECT_EQ(counts.senders[1].sender.port, second.port()) << "equal ones in the order of their sources";
  EXPECT_EQ(counts.senders[3].lost, 1);
}

TEST_F(MessageReceiverTest, WhatIsNotOfLcmIsCounted) {
  MessageReceiver& receiver = Listening();
  for (int i = 0; i < 2; ++i) sender_.SendDatagram(AsBytes("no message"));
  Receive();
  EXPECT_EQ(receiver.counts().not_lcm, 2);
  EXPECT_EQ(receiver.counts().received, 0);
}

TEST_F(MessageReceiverTest, AMessageThatIsIncompleteAtTheEndIsLost) {
  MessageReceiver& receiver = Listening();
  sender_.SendDatagram(
      FragmentDatagram({.sequence = 0, .size = 6, .offset = 0, .number = 0, .count = 2}, "A", "one"));
  Receive();
  EXPECT_EQ(receiver.counts().lost, 1);
  EXPECT_THAT(Taken(), IsEmpty());
}

TEST_F(MessageReceiverTest, WhatFindsNoSpaceIsCountedAsLossOfItsSender) {
  MessageReceiver& receiver = Listening("", 100);
  sender_.Send("A", "fits");
  for (int i = 0; i < 3; ++i) sender_.Send("A", std::string(100, 'x'));
  TestSender second(group_);
  second.Send("A", std::string(100, 'x'));
  Receive();
  EXPECT_THAT(Taken(), ElementsAre("A=fits"));
  const ReceiverCounts counts = receiver.counts();
  EXPECT_EQ(counts.received, 5);
  EXPECT_EQ(counts.overflow, 4);
  EXPECT_EQ(counts.lost, 0);
  ASSERT_THAT(counts.senders, SizeIs(2));
  EXPECT_EQ(counts.senders[0].lost, 3);
  EXPECT_EQ(counts.senders[1].lost, 1);
}

TEST_F(MessageReceiverTest, TakesTheSelectedChannelsOnly) {
  ChannelFilter filter;
  ASSERT_TRUE(filter.Set("^A", false));
  MessageReceiver& receiver = Make(filter);
  ASSERT_TRUE(receiver.Listen(group_.Url()));
  for (const char* channel : {"A", "B", "A2"}) sender_.Send(channel, "");
  Receive();
  EXPECT_THAT(Taken(), ElementsAre("A=", "A2="));
  EXPECT_EQ(receiver.counts().received, 3) << "selected or not";
}

TEST_F(MessageReceiverTest, RefusesTheMessagesOfAnotherMachineAndNamesIt) {
  MessageReceiver& receiver = Make({}, "press1");
  ASSERT_TRUE(receiver.Listen(group_.Url()));
  for (const char* machine : {"press2", "press1"}) {
    bus_health_t message{};
    message.machine = machine;
    message.machine_id = NameHash(machine);
    std::vector<std::uint8_t> data(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(data.data(), 0, static_cast<int>(data.size()));
    sender_.Send(std::string("BUS/") + machine, AsText(data));
  }
  Receive();
  const std::vector<std::string> taken = Taken();
  ASSERT_THAT(taken, SizeIs(1));
  EXPECT_THAT(taken[0], StartsWith("BUS/press1="));
  const ReceiverCounts counts = receiver.counts();
  ASSERT_THAT(counts.machines, SizeIs(1));
  EXPECT_EQ(counts.machines[0].name, "press2");
  EXPECT_EQ(counts.overflow, 0);
}

TEST_F(MessageReceiverTest, CountsWhatTheKernelDropped) {
  MessageReceiver& receiver = Listening("&recv_buf_size=8192");
  for (int i = 0; i < 200; ++i) sender_.Send("A", std::string(500, 'x'));
  Receive();
  const ReceiverCounts counts = receiver.counts();
  EXPECT_GT(counts.kernel_dropped, 0);
  EXPECT_EQ(counts.received + counts.kernel_dropped, 200);
}

// A source of LCM that fails ends the reception without a last count.
TEST_F(MessageReceiverTest, CountsWhatTheKernelDropsWhileItReceives) {
  MessageReceiver& receiver = Listening("&recv_buf_size=8192");
  ASSERT_TRUE(receiver.Listen(Source(std::vector<LogEvent>(1'001, MessageOf("B", "", 0)))));
  for (int i = 0; i < 200; ++i) sender_.Send("A", std::string(500, 'x'));
  const WakeEvent never;
  EXPECT_FALSE(receiver.Run(never.FileDescriptor()));
  EXPECT_GT(receiver.counts().kernel_dropped, 0);
}

class MessageReceiverStopTest : public MessageReceiverTest {
 protected:
  static constexpr int kFirst = 256;  // datagrams of a source that are read before the others are looked at
  // Receives until a stop at `utime` (us, UNIX time), and returns the number of messages.
  std::int64_t ReceivedUntil(std::int64_t utime) {
    clock_.StepUtc(utime - clock_.UtcMicroseconds());
    Receive();
    return receiver_->counts().received;
  }
  void SendMany(int count) {
    for (int i = 0; i < count; ++i) sender_.Send("A", "");
  }
};

TEST_F(MessageReceiverStopTest, WhatArrivedBeforeTheStopIsReceived) {
  Listening();
  SendMany(kFirst + 40);
  EXPECT_EQ(ReceivedUntil(system_clock_.UtcMicroseconds() + 1'000'000), kFirst + 40);
}

TEST_F(MessageReceiverStopTest, WhatArrivesAfterTheStopIsNot) {
  Listening();
  SendMany(kFirst + 40);
  EXPECT_EQ(ReceivedUntil(system_clock_.UtcMicroseconds() - 60'000'000), kFirst);
}

TEST_F(MessageReceiverTest, ReceivesByLcmWithItsOwnTime) {
  ChannelFilter filter;
  ASSERT_TRUE(filter.Set("^A", false));
  MessageReceiver& receiver = Make(filter);
  ASSERT_TRUE(receiver.Listen(Source({MessageOf("A", "one", 0), MessageOf("B", "", 0), MessageOf("A", "two", 0),
                                      MessageOf("A", "", kMuchLater)})));
  Receive();
  EXPECT_THAT(Taken(), ElementsAre("A=one", "A=two"));
  EXPECT_THAT(utimes_, ElementsAre(clock_.UtcMicroseconds(), clock_.UtcMicroseconds()));
  EXPECT_EQ(receiver.counts().received, 3);
  EXPECT_THAT(receiver.counts().senders, IsEmpty()) << "liblcm does not report them";
}

TEST_F(MessageReceiverTest, WhatLcmHasReceivedAtTheStopIsTakenToTheEnd) {
  MessageReceiver& receiver = Make();
  ASSERT_TRUE(receiver.Listen(Source(std::vector<LogEvent>(3'500, MessageOf("A", "", 0)))));
  Receive();
  EXPECT_EQ(receiver.counts().received, 3'500);
}

TEST_F(MessageReceiverTest, ASourceOfLcmThatFailsEndsTheReception) {
  MessageReceiver& receiver = Make();
  const std::string url = Source({MessageOf("A", "last", 0)});
  ASSERT_TRUE(receiver.Listen(url));
  const WakeEvent never;
  const Result<> received = receiver.Run(never.FileDescriptor());
  EXPECT_EQ(ErrorText(received), "LCM failed on " + url + ": start its server, and record again");
  EXPECT_THAT(Taken(), ElementsAre("A=last"));
}

TEST_F(MessageReceiverTest, OpensTheMemoryOfTheProcessByLcm) {
  MessageReceiver& receiver = Make();
  EXPECT_TRUE(receiver.Listen("memq://"));
  Receive();
  EXPECT_EQ(receiver.counts().received, 0);
}

TEST_F(MessageReceiverTest, AUrlThatCannotBeOpenedIsAnError) {
  MessageReceiver& receiver = Make();
  EXPECT_THAT(ErrorText(receiver.Listen("udpm://10.0.0.1:7667")), HasSubstr("the LCM URL 'udpm://10.0.0.1:7667'"));
  EXPECT_THAT(ErrorText(receiver.Listen("tcpq://127.0.0.1:1")), HasSubstr("no server answers there"));
}

// An interface that is missing may come later: its port is opened nevertheless.
TEST_F(MessageReceiverTest, AnInterfaceThatIsMissingIsReported) {
  MessageReceiver& receiver = Make();
  ASSERT_TRUE(receiver.Listen(group_.Url("", "nosuch0")));
  ASSERT_TRUE(receiver.Listen(TestGroup(1).Url("", "nosuch1")));
  Receive();
  EXPECT_THAT(receiver.counts().network, HasSubstr("nosuch0"));
}

TEST_F(MessageReceiverTest, APortThatAnotherProgramHoldsIsAnError) {
  const TestGroup held(2);
  const Descriptor holder(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in any = held.Address();
  any.sin_addr.s_addr = INADDR_ANY;
  ASSERT_EQ(bind(holder.get(), reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
  MessageReceiver& receiver = Make();
  EXPECT_THAT(ErrorText(receiver.Listen(held.Url("", "nosuch0"))),
              StartsWith(held.Url("", "nosuch0") + ": the port of LCM cannot be used"));
}

TEST_F(MessageReceiverTest, ABufferThatIsSmallerThanRequestedIsAWarning) {
  const WithoutPrivileges user;
  MessageReceiver& receiver = Make();
  const std::string url = group_.Url("&recv_buf_size=1073741824");
  ASSERT_TRUE(receiver.Listen(url));
  ASSERT_THAT(receiver.warnings(), SizeIs(1));
  EXPECT_THAT(receiver.warnings()[0], StartsWith(url + ": the kernel buffers "));
}

}  // namespace
}  // namespace axlecast
