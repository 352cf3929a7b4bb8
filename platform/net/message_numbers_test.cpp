#include "platform/net/udpm_receiver.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr std::int64_t kNow = 1'000'000'000;

class MessageNumbersTest : public ::testing::Test {
 protected:
  void Receive(std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t number = first; number != last + 1; ++number) numbers_.Receive(number, kNow);
  }

  MessageNumbers numbers_;
};

TEST_F(MessageNumbersTest, CountsEveryGapAndNothingElse) {
  Receive(0, 99);
  Receive(103, 200);
  Receive(202, 202);
  EXPECT_EQ(numbers_.lost(), 4);
  EXPECT_EQ(numbers_.repeated(), 0);
}

TEST_F(MessageNumbersTest, MissesNothingOfBeforeItsBeginning) {
  Receive(7'000, 7'010);
  EXPECT_EQ(numbers_.lost(), 0);
}

TEST_F(MessageNumbersTest, GoesOnWhereTheNumbersWrapAround) {
  Receive(0xfffffff0, 0xfffffffe);  // 0xffffffff is missing, and 0
  Receive(1, 5);
  EXPECT_EQ(numbers_.lost(), 2);
  numbers_.Receive(0xffffffff, kNow);
  numbers_.Receive(0, kNow);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_EQ(numbers_.repeated(), 0);
}

TEST_F(MessageNumbersTest, TakesBackWhatOnlyCameLate) {
  Receive(0, 9);
  Receive(12, 12);
  EXPECT_EQ(numbers_.lost(), 2);
  Receive(11, 11);
  EXPECT_EQ(numbers_.lost(), 1);
  Receive(11, 11);
  EXPECT_EQ(numbers_.lost(), 1);
  EXPECT_EQ(numbers_.repeated(), 1);
}

TEST_F(MessageNumbersTest, ReorderingAtTheBeginningCostsNothing) {
  for (const std::uint32_t number : {3U, 1U, 2U, 0U, 4U, 6U, 5U}) numbers_.Receive(number, kNow);
  EXPECT_EQ(numbers_.lost(), 0);
}

TEST_F(MessageNumbersTest, CountsGapsWiderThanItsMemory) {
  Receive(0, 0);
  Receive(1'000'001, 1'000'001);
  EXPECT_EQ(numbers_.lost(), 1'000'000);
  Receive(999'999, 999'999);
  EXPECT_EQ(numbers_.lost(), 999'999);
}

TEST_F(MessageNumbersTest, AProgramThatStartsAgainBeginsAnew) {
  Receive(10'000, 10'100);
  Receive(0, 10);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_EQ(numbers_.repeated(), 0);
  Receive(12, 12);
  EXPECT_EQ(numbers_.lost(), 1);
}

TEST_F(MessageNumbersTest, AProgramThatStartsAgainAfterAFewMessagesBeginsAnewToo) {
  Receive(0, 5);
  const std::int64_t later = kNow + MessageNumbers::kSilenceUs;
  numbers_.Receive(0, later);
  numbers_.Receive(2, later);
  EXPECT_EQ(numbers_.lost(), 1);
  EXPECT_EQ(numbers_.repeated(), 0);
}

TEST_F(MessageNumbersTest, ACopyOfTheFirstMessageIsNoRestart) {
  Receive(0, 5);
  numbers_.Receive(0, kNow + MessageNumbers::kSilenceUs - 1);
  Receive(6, 6);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_EQ(numbers_.repeated(), 1);
}

TEST_F(MessageNumbersTest, AJumpTooFarAheadIsANewNumbering) {
  Receive(0, 0);
  Receive(0x40000000, 0x40000000);
  EXPECT_EQ(numbers_.lost(), 0);
  Receive(0x40000002, 0x40000002);
  EXPECT_EQ(numbers_.lost(), 1);
}

TEST_F(MessageNumbersTest, WhatIsAwaitedIsLostUntilItComes) {
  EXPECT_TRUE(numbers_.Await(5, kNow));
  EXPECT_TRUE(numbers_.Await(5, kNow));
  EXPECT_EQ(numbers_.lost(), 1);
  numbers_.Receive(6, kNow);
  EXPECT_EQ(numbers_.lost(), 1);
  numbers_.Receive(5, kNow);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_FALSE(numbers_.Await(5, kNow)) << "a copy";
  EXPECT_EQ(numbers_.lost(), 0);
}

TEST_F(MessageNumbersTest, EveryRememberedNumberIsLateOnceAndThenRepeated) {
  const auto number = [](std::int64_t i) { return static_cast<std::uint32_t>(i); };
  for (std::int64_t i = 1; i < MessageNumbers::kRemembered; i += 2) numbers_.Receive(number(i), kNow);
  for (std::int64_t i = 2; i < MessageNumbers::kRemembered; i += 2) numbers_.Receive(number(i), kNow);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_EQ(numbers_.repeated(), 0);
  Receive(1, number(MessageNumbers::kRemembered - 1));
  EXPECT_EQ(numbers_.repeated(), MessageNumbers::kRemembered - 1);
}

TEST_F(MessageNumbersTest, AStragglerFromBeforeANewNumberingIsNotMissing) {
  Receive(0, 100);
  Receive(0x40000000, 0x40000000);
  Receive(0x3fffffff, 0x3fffffff);
  EXPECT_EQ(numbers_.lost(), 0);
  EXPECT_EQ(numbers_.repeated(), 0);
}

TEST_F(MessageNumbersTest, ZeroInItsTurnAfterASilenceIsNoRestart) {
  Receive(0xfffffff0, 0xfffffffd);
  Receive(0xffffffff, 0xffffffff);
  numbers_.Receive(0, kNow + MessageNumbers::kSilenceUs);
  EXPECT_EQ(numbers_.lost(), 1);
  numbers_.Receive(0xfffffffe, kNow + MessageNumbers::kSilenceUs);
  EXPECT_EQ(numbers_.lost(), 0) << "the number that was missing is late";
}

TEST_F(MessageNumbersTest, ACopyAfterASilenceIsRepeatedUnlessItIsZero) {
  Receive(0, 5);
  numbers_.Receive(5, kNow + MessageNumbers::kSilenceUs);
  EXPECT_EQ(numbers_.repeated(), 1);
}

TEST_F(MessageNumbersTest, AProgramThatStartsAgainAfterItsFirstMessageRepeatsNothing) {
  Receive(0, 0);
  numbers_.Receive(0, kNow + MessageNumbers::kSilenceUs);
  EXPECT_EQ(numbers_.repeated(), 0);
  EXPECT_EQ(numbers_.lost(), 0);
}

TEST_F(MessageNumbersTest, UpTo64StragglersFromBeforeTheBeginDoNotBeginANewNumbering) {
  Receive(1'000, 1'000);
  Receive(1'000 - 64, 1'000 - 64);
  Receive(1'001, 1'001);
  EXPECT_EQ(numbers_.lost(), 0);
  Receive(1'001 - 67, 1'001 - 67);  // one too far back: numbers continue from here
  Receive(1'001, 1'001);
  EXPECT_EQ(numbers_.lost(), 66);
}

TEST_F(MessageNumbersTest, TheFarthestJumpAheadIsOneLessThanItsLimit) {
  Receive(0, 0);
  const auto limit = static_cast<std::uint32_t>(MessageNumbers::kFarthestAhead);
  Receive(limit + 1, limit + 1);
  EXPECT_EQ(numbers_.lost(), 0) << "a new numbering";
  Receive(2 * limit + 1, 2 * limit + 1);
  EXPECT_EQ(numbers_.lost(), MessageNumbers::kFarthestAhead - 1);
}

}  // namespace
}  // namespace axlecast
