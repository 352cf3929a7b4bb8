#include "platform/net/web_connections.h"

#include <gmock/gmock.h>

#include <array>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class WebConnectionsTest : public ::testing::Test {
 protected:
  static constexpr const char* kA = "192.0.2.1";
  static constexpr const char* kB = "192.0.2.2";
  static constexpr const char* kHere = "";

  [[nodiscard]] WebConnections::Id Id(std::size_t number) const { return &places_.at(number); }
  void Open(std::size_t number, const char* address, MonoNs at) {
    EXPECT_TRUE(connections_.Admit(address, at).admitted);
    connections_.Add(Id(number), address, at);
  }

  std::array<char, 16> places_{};
  WebConnections connections_{{.total = 4, .per_address = 2}};
};

TEST_F(WebConnectionsTest, ARequestHasADeadlineWhateverTrickles) {
  Open(0, kA, 0);
  EXPECT_THAT(connections_.ToClose(WebConnections::kRequest - 1), IsEmpty());
  EXPECT_THAT(connections_.ToClose(WebConnections::kRequest), ElementsAre(Id(0)));
  EXPECT_THAT(connections_.ToClose(WebConnections::kRequest + 1), ElementsAre(Id(0))) << "until it is gone";
  connections_.Remove(Id(0));
  EXPECT_THAT(connections_.ToClose(kNever), IsEmpty());
}

TEST_F(WebConnectionsTest, SoHasItsAnswerAndThePauseAfterIt) {
  Open(0, kA, 0);
  connections_.OnWholeRequest(Id(0), kSecond);
  EXPECT_THAT(connections_.ToClose(kSecond + WebConnections::kAnswer - 1), IsEmpty());
  connections_.OnAnswered(Id(0), 10 * kSecond);
  EXPECT_THAT(connections_.ToClose(10 * kSecond + WebConnections::kRequest - 1), IsEmpty());
  EXPECT_THAT(connections_.ToClose(10 * kSecond + WebConnections::kRequest), ElementsAre(Id(0)));
}

TEST_F(WebConnectionsTest, AWebSocketHasNoDeadline) {
  Open(0, kA, 0);
  connections_.OnWebSocket(Id(0), kSecond);
  EXPECT_THAT(connections_.ToClose(kNever), IsEmpty());
}

TEST_F(WebConnectionsTest, AnAddressThatHasItsShareGivesUpItsOldestForItsNext) {
  Open(0, kA, 0);
  Open(1, kA, 1);
  const auto third = connections_.Admit(kA, 2);
  EXPECT_TRUE(third.admitted);
  EXPECT_EQ(third.close, Id(0));
  EXPECT_EQ(connections_.Admit(kB, 3).close, nullptr) << "another address is not concerned";
  EXPECT_THAT(connections_.ToClose(4), ElementsAre(Id(0)));
}

TEST_F(WebConnectionsTest, AnAddressFullOfWebSocketsGetsNoMore) {
  Open(0, kA, 0);
  Open(1, kA, 0);
  connections_.OnWebSocket(Id(0), 0);
  connections_.OnWebSocket(Id(1), 0);
  EXPECT_FALSE(connections_.Admit(kA, kSecond).admitted);
  EXPECT_TRUE(connections_.Admit(kB, kSecond).admitted);
}

TEST_F(WebConnectionsTest, ThisHostMayHaveAllAndAFullServerClosesTheSlowest) {
  for (std::size_t i = 0; i < 4; ++i) Open(i, kHere, static_cast<MonoNs>(i));
  connections_.OnWholeRequest(Id(0), 10);
  EXPECT_EQ(connections_.Admit(kB, 11).close, Id(1)) << "the oldest whose answer is not on the way";
  connections_.Remove(Id(1));
  connections_.Add(Id(4), kB, 11);
  for (const std::size_t i : {2U, 3U, 4U}) connections_.OnWholeRequest(Id(i), 12);
  EXPECT_FALSE(connections_.Admit(kA, 13).admitted) << "all are being answered";
  const auto later = connections_.Admit(kA, 10 + WebConnections::kSlowAnswer);
  EXPECT_TRUE(later.admitted);
  EXPECT_EQ(later.close, Id(0)) << "its answer is taken slowly";
}

TEST_F(WebConnectionsTest, WhatIsBeingClosedCountsNoLonger) {
  for (std::size_t i = 0; i < 4; ++i) Open(i, kHere, 0);
  EXPECT_NE(connections_.Admit(kHere, 1).close, nullptr);
  EXPECT_EQ(connections_.Admit(kHere, 1).close, nullptr) << "room was made by the one before";
}

TEST(WebAddressKeyTest, IsAHostOrItsNetwork) {
  EXPECT_EQ(WebAddressKey("192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(WebAddressKey("::ffff:192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(WebAddressKey("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::/64");
  EXPECT_EQ(WebAddressKey("2001:db8:1:2::9"), "2001:db8:1:2::/64");
  for (const char* here : {"127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"}) EXPECT_EQ(WebAddressKey(here), "");
}

}  // namespace
}  // namespace axlecast
