#include "tools/recorder/message_receiver.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

SenderAddress Sender(std::uint32_t number) {
  SenderAddress sender{};
  sender.address = number;
  return sender;
}

TEST(OverflowTally, CountsTheSendersThatCameFirstHoweverManyAreInvented) {
  OverflowTally tally;
  tally.On(Sender(7));
  for (std::uint32_t number = 100; number < 100'000; ++number) tally.On(Sender(number));
  tally.On(Sender(7));
  EXPECT_EQ(tally.senders(), UdpmReceiver::kMaxSenders);
  EXPECT_EQ(tally.Of(Sender(7)), 2);
  EXPECT_EQ(tally.Of(Sender(99'999)), 0);
}

}  // namespace
}  // namespace axlecast
