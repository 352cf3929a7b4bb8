#include "core/messages/sequence_count.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(SequenceCount, TheFirstNumberIsTheBeginning) {
  SequenceCount count;
  count.On(1, 1000);
  count.On(1, 1001);
  EXPECT_EQ(count.received(), 2);
  EXPECT_EQ(count.lost(), 0);
}

TEST(SequenceCount, CountsGaps) {
  SequenceCount count;
  for (const std::int64_t seq : {0, 1, 5, 6, 8}) count.On(1, seq);
  EXPECT_EQ(count.lost(), 4);
}

TEST(SequenceCount, ALateOneIsNotLost) {
  SequenceCount count;
  for (const std::int64_t seq : {0, 2, 1, 3}) count.On(1, seq);
  EXPECT_EQ(count.lost(), 0);
  EXPECT_EQ(count.received(), 4);
}

TEST(SequenceCount, WhatComesTwiceFillsNoGap) {
  SequenceCount count;
  for (const std::int64_t seq : {0, 1, 4, 1, 4, 0}) count.On(1, seq);
  EXPECT_EQ(count.lost(), 2);
  for (const std::int64_t seq : {3, 3, 3}) count.On(1, seq);
  EXPECT_EQ(count.lost(), 1);
  count.On(1, 2);
  EXPECT_EQ(count.lost(), 0);
}

TEST(SequenceCount, EachNumberOfALongGapMayComeLate) {
  SequenceCount count;
  count.On(1, 0);
  count.On(1, 100);
  EXPECT_EQ(count.lost(), 99);
  for (std::int64_t seq = 99; seq > 0; seq -= 2) count.On(1, seq);
  EXPECT_EQ(count.lost(), 49);
}

TEST(SequenceCount, OfVeryManyGapsTheOldestStaysLost) {
  SequenceCount count;
  for (std::int64_t seq = 0; seq <= 100; seq += 2) count.On(1, seq);
  EXPECT_EQ(count.lost(), 50);
  count.On(1, 1);
  EXPECT_EQ(count.lost(), 50) << "its gap is forgotten";
  count.On(1, 99);
  EXPECT_EQ(count.lost(), 49);
}

TEST(SequenceCount, ANewBootIdBeginsAnew) {
  SequenceCount count;
  count.On(1, 500);
  count.On(2, 0);
  count.On(2, 1);
  EXPECT_EQ(count.lost(), 0);
}

TEST(SequenceCount, NumbersFromAStrangerDoNotOverflow) {
  SequenceCount count;
  for (const std::int64_t seq : {std::int64_t{0}, INT64_MAX, INT64_MIN, std::int64_t{-1}}) count.On(1, seq);
  EXPECT_EQ(count.lost(), 0);
  for (std::int64_t boot = 0; boot < 10'000; ++boot) count.On(boot, 3);
  EXPECT_EQ(count.lost(), 2);
}

TEST(SequenceCount, RemembersAFewPublishersHoweverManyBootIdsCome) {
  SequenceCount count;
  for (std::int64_t boot = 1; boot <= 10'000; ++boot) count.On(boot, 0);
  for (std::int64_t boot = 1; boot <= 9'900; ++boot) count.On(boot, 5);  // of each that is forgotten, the beginning
  EXPECT_EQ(count.lost(), 0);
  SequenceCount few;
  for (std::int64_t boot = 1; boot <= 64; ++boot) few.On(boot, 0);
  for (std::int64_t boot = 1; boot <= 64; ++boot) few.On(boot, 5);
  EXPECT_EQ(few.lost(), 64 * 4);
}

}  // namespace
}  // namespace axlecast
