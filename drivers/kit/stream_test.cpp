#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "drivers/kit/stream.h"

namespace axlecast {
namespace {

TEST(CadenceTest, NothingIsExpectedBeforeTheStart) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  EXPECT_EQ(cadence.due(), kNever);
  EXPECT_FALSE(cadence.FellSilent(1'000 * kSecond));
}

TEST(CadenceTest, ReportsSilenceOnceAndAgainAfterTheStreamCameBack) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  cadence.Arrived(kSecond);
  EXPECT_EQ(cadence.due(), kSecond + 300 * kMillisecond);
  EXPECT_FALSE(cadence.FellSilent(kSecond + 300 * kMillisecond - 1));
  EXPECT_TRUE(cadence.FellSilent(kSecond + 300 * kMillisecond));
  EXPECT_TRUE(cadence.silent());
  EXPECT_FALSE(cadence.FellSilent(kSecond + 400 * kMillisecond));
  cadence.Arrived(2 * kSecond);
  EXPECT_FALSE(cadence.silent());
  EXPECT_TRUE(cadence.FellSilent(2 * kSecond + 301 * kMillisecond));
}

// An SAA on CAN set to 100 ms was seen sending every 106.4 ms (device-facts): three periods tolerate that for ever.
TEST(CadenceTest, ASlowStreamIsNotSilent) {
  PeriodMonitor cadence(100 * kMillisecond, 3);
  for (MonoNs now = 0; now < 60 * kSecond; now += 106'400 * kMicrosecond) {
    EXPECT_FALSE(cadence.FellSilent(now));
    cadence.Arrived(now);
  }
}

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

// More pieces than the buffer distinguishes: an interval may widen, but always contains the arrival.
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
