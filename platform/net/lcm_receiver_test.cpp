#include "platform/net/lcm_receiver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;

constexpr std::array<std::uint8_t, 1> kMessage{7};

class ChannelSubscriptionsTest : public ::testing::Test {
 protected:
  ChannelSubscriptions::Handler Into(const std::string& mark) {
    return [this, mark](const std::string& channel, Bytes) { calls_.push_back(mark + channel); };
  }
  std::vector<std::string> calls_;
};

TEST_F(ChannelSubscriptionsTest, CallsEveryHandlerThatMatchesInTheirOrder) {
  ChannelSubscriptions subscriptions("");
  ASSERT_TRUE(subscriptions.Add("B.*", Into("1 ")));
  ASSERT_TRUE(subscriptions.Add("A|BUS/x", Into("2 ")));
  EXPECT_EQ(subscriptions.Dispatch("BUS/x", kMessage), 2U);
  EXPECT_EQ(subscriptions.Dispatch("AB", kMessage), 0U);
  EXPECT_EQ(subscriptions.Dispatch("", kMessage), 0U);
  EXPECT_EQ(subscriptions.Dispatch("A", kMessage), 1U);
  EXPECT_THAT(calls_, ElementsAre("1 BUS/x", "2 BUS/x", "2 A"));
}

TEST_F(ChannelSubscriptionsTest, AnEmptyNameIsMatchedAsAnyOther) {
  ChannelSubscriptions subscriptions("");
  ASSERT_TRUE(subscriptions.Add(".*", Into("1 ")));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(subscriptions.Dispatch("", kMessage), 1U);
}

TEST_F(ChannelSubscriptionsTest, ASubscriptionCountsAlsoForNamesThatCameBefore) {
  ChannelSubscriptions subscriptions("");
  ASSERT_TRUE(subscriptions.Add("A", Into("1 ")));
  EXPECT_EQ(subscriptions.Dispatch("B", kMessage), 0U);
  ASSERT_TRUE(subscriptions.Add("B", Into("2 ")));
  EXPECT_EQ(subscriptions.Dispatch("B", kMessage), 1U);
}

TEST_F(ChannelSubscriptionsTest, ThePrefixIsText) {
  ChannelSubscriptions subscriptions("cell.1/");
  ASSERT_TRUE(subscriptions.Add(".*", Into("")));
  EXPECT_EQ(subscriptions.Dispatch("cell-1/A", kMessage), 0U);
  EXPECT_EQ(subscriptions.Dispatch("cell.1/A", kMessage), 1U);
  EXPECT_THAT(calls_, ElementsAre("A"));
}

TEST_F(ChannelSubscriptionsTest, RefusesAPatternThatIsNone) {
  ChannelSubscriptions subscriptions("");
  EXPECT_FALSE(subscriptions.Add("(", Into("")));
  EXPECT_TRUE(subscriptions.empty());
  EXPECT_EQ(subscriptions.Dispatch("A", kMessage), 0U);
}

TEST_F(ChannelSubscriptionsTest, CountsTheMemoryOfItsNames) {
  ChannelSubscriptions subscriptions("");
  EXPECT_EQ(subscriptions.memory(), 0U);
  ASSERT_TRUE(subscriptions.Add(".*", Into("")));
  const std::size_t before = subscriptions.memory();
  EXPECT_GE(before, ChannelSubscriptions::kRememberedNames * 2 * sizeof(std::string));
  subscriptions.Dispatch(std::string(1'000, 'x'), kMessage);
  EXPECT_GE(subscriptions.memory(), before + 1'900) << "the name with its prefix, and without";
}

TEST_F(ChannelSubscriptionsTest, CountsTheMemoryOfTheIndexesOfItsSubscriptions) {
  constexpr std::size_t kSubscriptions = 200;
  ChannelSubscriptions subscriptions("");
  for (std::size_t i = 0; i < kSubscriptions; ++i) ASSERT_TRUE(subscriptions.Add(".*", Into("")));
  const std::size_t before = subscriptions.memory();
  EXPECT_EQ(subscriptions.Dispatch("A", kMessage), kSubscriptions);
  EXPECT_GE(subscriptions.memory(), before + kSubscriptions * sizeof(std::uint16_t));
}

TEST_F(ChannelSubscriptionsTest, CallsHandlersWithTheNameThatCame) {
  ChannelSubscriptions subscriptions("cell/");
  ASSERT_TRUE(subscriptions.Add(".*", Into("")));
  for (int i = 0; i < 3'000; ++i) {
    const std::string name = std::to_string(i);
    subscriptions.Dispatch("cell/" + name, kMessage);
    ASSERT_EQ(calls_.back(), name);
    subscriptions.Dispatch("cell/" + name, kMessage);
    ASSERT_EQ(calls_.back(), name);
  }
}

// liblcm kept about 150 bytes of every name that it received: 600,000 names cost 180 MB in each process.
TEST_F(ChannelSubscriptionsTest, HoldsNoMoreHoweverManyNamesCome) {
  ChannelSubscriptions subscriptions("");
  std::size_t wanted = 0;
  ASSERT_TRUE(subscriptions.Add("POSITION/.*", [&wanted](const std::string&, Bytes) { ++wanted; }));
  for (int i = 0; i < 100'000; ++i) {
    subscriptions.Dispatch("NAME/" + std::string(50, 'x') + std::to_string(i), kMessage);
    if (i % 100 == 0) subscriptions.Dispatch("POSITION/axis1", kMessage);
  }
  EXPECT_EQ(wanted, 1'000U);
  EXPECT_LE(subscriptions.memory(), 512U << 10);
}

}  // namespace

}  // namespace axlecast
