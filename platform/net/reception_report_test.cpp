#include "platform/net/reception_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ReceptionReport, NothingIsReportedWhileNothingIsLost) {
  ReceptionReport report;
  EXPECT_EQ(report.Next({.messages = 1'000}, kSecond), "");
}

TEST(ReceptionReport, ReportsAtMostOnceInTenSecondsAndNothingTwice) {
  ReceptionReport report;
  EXPECT_EQ(report.Next({.dropped = 1}, kSecond),
            "LCM since the start: 1 datagram lost because this process's receive buffer was full");
  EXPECT_EQ(report.Next({.dropped = 2}, 2 * kSecond), "");
  EXPECT_THAT(report.Next({.dropped = 3}, 11 * kSecond), HasSubstr("3 datagrams lost"));
  EXPECT_EQ(report.Next({.dropped = 3}, 30 * kSecond), "");
}

TEST(ReceptionReport, NamesTheRemedyOnlyOfALoss) {
  EXPECT_THAT(ReceptionText({.dropped = 5}, "as root: sysctl"), HasSubstr("(as root: sysctl)"));
  const std::string refused = ReceptionText({.outside = 7, .malformed = 8}, "as root: sysctl");
  EXPECT_THAT(refused, Not(HasSubstr("sysctl")));
  EXPECT_THAT(refused, HasSubstr("7 datagrams from other hosts refused, because the URL says ttl=0; 8 datagrams"));
}

}  // namespace
}  // namespace axlecast
