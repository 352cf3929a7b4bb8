#include "platform/net/lcm_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <csignal>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "platform/os/process.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ReceptionReport, NothingIsReportedWhileNothingIsLost) {
  ReceptionReport report;
  EXPECT_EQ(report.NextLine({.messages = 1'000}, kSecond), "");
}

TEST(ReceptionReport, ReportsAtMostOnceInTenSecondsAndNothingTwice) {
  ReceptionReport report;
  EXPECT_EQ(report.NextLine({.dropped = 1}, kSecond),
            "LCM since the start: 1 datagram lost because this process's receive buffer was full");
  EXPECT_EQ(report.NextLine({.dropped = 2}, 2 * kSecond), "");
  EXPECT_THAT(report.NextLine({.dropped = 3}, 11 * kSecond), HasSubstr("3 datagrams lost"));
  EXPECT_EQ(report.NextLine({.dropped = 3}, 30 * kSecond), "");
}

TEST(ReceptionReport, NamesTheRemedyOnlyOfALoss) {
  EXPECT_THAT(ReceptionText({.dropped = 5}, "as root: sysctl"), HasSubstr("(as root: sysctl)"));
  const std::string refused = ReceptionText({.outside = 7, .malformed = 8}, "as root: sysctl");
  EXPECT_THAT(refused, Not(HasSubstr("sysctl")));
  EXPECT_THAT(refused, HasSubstr("7 datagrams from other hosts refused, because the URL has ttl=0; 8 datagrams"));
}

TEST(ReceptionReport, ReportsANetworkThatCannotBeUsedAndItsEnd) {
  const ReceptionCounts good;
  const ReceptionCounts bad{.network = "this host has no interface eth1"};
  ReceptionReport report;
  EXPECT_FALSE(report.Changed(good));
  EXPECT_TRUE(report.Changed(bad));
  EXPECT_EQ(report.NextLine(bad, kSecond), "LCM: this host has no interface eth1");
  EXPECT_EQ(report.NextLine(bad, 20 * kSecond), "");
  EXPECT_EQ(report.NextLine(good, 40 * kSecond), "LCM: the network can be used again");
  EXPECT_FALSE(report.Changed(good));
}

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

using Received = std::vector<std::pair<std::string, std::vector<std::uint8_t>>>;

LcmPort::Handler Into(Received& received) {
  return [&received](const std::string& channel, Bytes message) {
    received.emplace_back(channel, std::vector<std::uint8_t>(message.begin(), message.end()));
  };
}

constexpr std::array<std::uint8_t, 3> kMessage{1, 2, 3};

auto Carries(const char* channel) { return Pair(channel, ElementsAre(1, 2, 3)); }

TEST(LcmPort, DeliversWhatWasPublished) {
  LcmPort port("memq://", "");
  ASSERT_EQ(port.problem(), "");
  Received received;
  ASSERT_TRUE(port.Subscribe("POSITION/.*", Into(received)));
  port.Publish("POSITION/axis1", kMessage);
  port.Publish("ALARM/axis1", kMessage);
  port.Publish("XPOSITION/axis1", kMessage);
  port.Publish("POSITION/axis2", {});
  EXPECT_TRUE(port.Handle(1000));
  EXPECT_THAT(received, ElementsAre(Carries("POSITION/axis1"), Pair("POSITION/axis2", IsEmpty())));
  EXPECT_EQ(port.unsent(), 0);
}

TEST(LcmPort, HandleEndsWhenNothingComes) {
  LcmPort port("memq://", "");
  ASSERT_TRUE(port.Subscribe("A", [](const std::string&, Bytes) {}));
  EXPECT_TRUE(port.Handle(0));
  EXPECT_GE(port.FileDescriptor(), 0);
}

TEST(LcmPort, AnAlternativeIsOverTheWholeName) {
  LcmPort port("memq://", "");
  Received received;
  ASSERT_TRUE(port.Subscribe("A|B", Into(received)));
  for (const char* channel : {"A", "B", "AX", "XB", "AB"}) port.Publish(channel, kMessage);
  EXPECT_TRUE(port.Handle(1000));
  EXPECT_THAT(received, ElementsAre(Carries("A"), Carries("B")));
}

TEST(LcmPort, ThePrefixIsTextAndHandlersDoNotSeeIt) {
  LcmPort prefixed("memq://", "cell.1/");
  Received received;
  ASSERT_TRUE(prefixed.Subscribe("POSITION/.*", Into(received)));
  prefixed.Publish("POSITION/axis1", kMessage);
  EXPECT_TRUE(prefixed.Handle(1000));
  EXPECT_THAT(received, ElementsAre(Carries("POSITION/axis1")));

  LcmPort plain("memq://", "");
  Received all;
  ASSERT_TRUE(plain.Subscribe(".*", Into(all)));
  plain.Publish("cell.1/POSITION/axis1", kMessage);
  EXPECT_TRUE(plain.Handle(1000));
  EXPECT_THAT(all, ElementsAre(Carries("cell.1/POSITION/axis1")));
}

TEST(LcmPort, ManyMessagesWaitInTheQueue) {
  LcmPort port("memq://", "");
  Received received;
  ASSERT_TRUE(port.Subscribe("A", Into(received), 5000));
  for (int i = 0; i < 2500; ++i) port.Publish("A", kMessage);
  for (int i = 0; i < 10 && received.size() < 2500; ++i) EXPECT_TRUE(port.Handle(1000));
  EXPECT_EQ(received.size(), 2500U);
}

TEST(LcmPort, WhatIsNoRegularExpressionIsRefused) {
  LcmPort port("memq://", "");
  for (const char* text : {"POSITION/(", "a)(b", "*", "[z-a]"}) {
    EXPECT_FALSE(port.Subscribe(text, [](const std::string&, Bytes) {})) << text;
  }
}

TEST(LcmPort, ANameBeyondLcmsLimitIsCounted) {
  LcmPort port("memq://", "");
  Received received;
  ASSERT_TRUE(port.Subscribe(".*", Into(received)));
  port.Publish(std::string(64, 'A'), kMessage);
  port.Publish(std::string(63, 'A'), kMessage);
  EXPECT_TRUE(port.Handle(1000));
  EXPECT_EQ(received.size(), 1U);
  EXPECT_EQ(port.unsent(), 1);
}

TEST(LcmPort, ASignalIsNoFailure) {
  LcmPort port("memq://", "");
  ASSERT_TRUE(port.Subscribe("A", [](const std::string&, Bytes) {}));
  const StopSignal stop;
  std::atomic<bool> over{false};
  // Signals keep coming until one has interrupted the wait.
  std::thread interrupter([&, waiting = pthread_self()] {
    while (!over) {
      pthread_kill(waiting, SIGTERM);
      std::this_thread::yield();
    }
  });
  EXPECT_TRUE(port.Handle(5'000));
  over = true;
  interrupter.join();
}

TEST(LcmPort, AMalformedUrlIsAProblemAndNothingWorks) {
  for (const char* url : {"", "udpm:/239.255.76.67:7667", "udpm://239.255.76.67", "udpm://10.0.0.1:7667",
                          "udpm://239.255.76.67:7667?tll=0", "udpm://239.255.76.67:0", "tcp://localhost:7700"}) {
    LcmPort port(url, "");
    EXPECT_THAT(port.problem(), HasSubstr("the LCM URL '" + std::string(url) + "'"));
    EXPECT_FALSE(port.Subscribe("A", [](const std::string&, Bytes) {}));
    EXPECT_FALSE(port.Handle(0));
    port.Publish("A", kMessage);
    EXPECT_EQ(port.unsent(), 1);
  }
}

TEST(LcmPort, WithoutATcpServerHasAProblem) {
  const LcmPort port("tcpq://127.0.0.1:1", "");
  EXPECT_THAT(port.problem(), HasSubstr("tcpq://127.0.0.1:1: no server answers there"));
  EXPECT_EQ(port.FileDescriptor(), -1);
}

}  // namespace

}  // namespace axlecast
