#include "drivers/kit/stream.h"

#include <gmock/gmock.h>

#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;

std::vector<std::uint8_t> Contents(const ReceiveBuffer& inbox) {
  return {inbox.bytes().begin(), inbox.bytes().end()};
}

void Put(ReceiveBuffer& inbox, const std::vector<std::uint8_t>& bytes, MonoNs at) {
  inbox.Append(bytes, {at, at + 1});
}

TEST(InboxTest, KeepsBytesInOrderWithTheirArrivals) {
  ReceiveBuffer inbox;
  Put(inbox, {1, 2}, 100);
  Put(inbox, {3}, 200);
  EXPECT_THAT(Contents(inbox), ElementsAre(1, 2, 3));
  EXPECT_EQ(inbox.ArrivalOf(0), (Interval{100, 101}));
  EXPECT_EQ(inbox.ArrivalOf(1), (Interval{100, 101}));
  EXPECT_EQ(inbox.ArrivalOf(2), (Interval{200, 201}));
}

TEST(InboxTest, ArrivalsFollowWhatIsDropped) {
  ReceiveBuffer inbox;
  Put(inbox, {1, 2}, 100);
  Put(inbox, {3, 4}, 200);
  inbox.Drop(1);
  EXPECT_EQ(inbox.ArrivalOf(0).first, 100);
  EXPECT_EQ(inbox.ArrivalOf(1).first, 200);
  inbox.Drop(2);
  EXPECT_THAT(Contents(inbox), ElementsAre(4));
  EXPECT_EQ(inbox.ArrivalOf(0).first, 200);
  inbox.Drop(1);
  EXPECT_TRUE(inbox.bytes().empty());
  Put(inbox, {5}, 300);
  EXPECT_EQ(inbox.ArrivalOf(0).first, 300);
}

TEST(InboxTest, WhenFullTheOldestGoesAndIsCounted) {
  ReceiveBuffer inbox;
  for (int i = 0; i < 300; ++i) Put(inbox, std::vector<std::uint8_t>(10, static_cast<std::uint8_t>(i)), i * 1'000);
  EXPECT_EQ(inbox.bytes().size(), ReceiveBuffer::kCapacity);
  EXPECT_EQ(inbox.overflowed(), 3'000 - static_cast<int>(ReceiveBuffer::kCapacity));
  EXPECT_EQ(inbox.bytes().back(), 299 % 256);
  EXPECT_EQ(inbox.ArrivalOf(ReceiveBuffer::kCapacity - 1).last, 299'001);
}

TEST(InboxTest, MoreThanItHoldsAtOnceLeavesTheNewest) {
  ReceiveBuffer inbox;
  std::vector<std::uint8_t> many(ReceiveBuffer::kCapacity + 3, 7);
  many.back() = 9;
  Put(inbox, many, 1);
  EXPECT_EQ(inbox.bytes().size(), ReceiveBuffer::kCapacity);
  EXPECT_EQ(inbox.bytes().back(), 9);
  EXPECT_EQ(inbox.overflowed(), 3);
}

// More pieces than are told apart: an interval may widen, but always holds the arrival.
TEST(InboxTest, ManySmallPiecesKeepTrueIntervals) {
  ReceiveBuffer inbox;
  for (int i = 0; i < 500; ++i) Put(inbox, {static_cast<std::uint8_t>(i)}, i * 10);
  for (std::size_t i = 0; i < 500; ++i) {
    const auto arrived = static_cast<MonoNs>(i) * 10;
    EXPECT_LE(inbox.ArrivalOf(i).first, arrived);
    EXPECT_GE(inbox.ArrivalOf(i).last, arrived);
  }
}

}  // namespace
}  // namespace axlecast
