#include "platform/db/connection_target.h"

#include <gtest/gtest.h>

#include <string>

namespace axlecast::db {
namespace {

TEST(SplitHosts, TriesEachHostInItsOrder) {
  const auto hosts = SplitHosts("host=db1,db2 port=5433 dbname=axlecast");
  ASSERT_TRUE(hosts) << hosts.error().text;
  ASSERT_EQ(hosts->size(), 2U);
  EXPECT_EQ(TargetText((*hosts)[0]), "db1:5433/axlecast");
  EXPECT_EQ(TargetText((*hosts)[1]), "db2:5433/axlecast");
}

TEST(SplitHosts, PairsPortsAndAddressesWithHosts) {
  const auto hosts = SplitHosts("postgresql://db1:1,db2:2/x?hostaddr=10.0.0.1,10.0.0.2");
  ASSERT_TRUE(hosts) << hosts.error().text;
  ASSERT_EQ(hosts->size(), 2U);
  EXPECT_EQ(TargetText((*hosts)[1]), "db2:2/x");
  EXPECT_EQ(ValueOf((*hosts)[1], "hostaddr"), "10.0.0.2");
}

TEST(SplitHosts, LeavesTheHostToTheEnvironment) {
  const auto hosts = SplitHosts("dbname=axlecast");
  ASSERT_TRUE(hosts) << hosts.error().text;
  ASSERT_EQ(hosts->size(), 1U);
  EXPECT_EQ(TargetText((*hosts)[0]), "the default host/axlecast");
}

TEST(SplitHosts, RefusesWhatDoesNotFit) {
  for (const char* connection :
       {"host=a,b,c port=1,2", "host", "hots=a", "host=a,b hostaddr=1.2.3.4,1.2.3.5,1.2.3.6", "host='a"}) {
    const auto hosts = SplitHosts(connection);
    ASSERT_FALSE(hosts) << connection;
    EXPECT_EQ(hosts.error().fault, DatabaseFault::kBadConnection);
    EXPECT_NE(hosts.error().text.find("not valid"), std::string::npos) << hosts.error().text;
  }
}

TEST(SplitHosts, NeverShowsAPassword) {
  for (const char* connection :
       {"host=a password=hunter2", "postgresql://me:hunter2@a/db", "host=a sslpassword=hunter2", "host=a hunter2",
        "host=a password hunter2", "postgresql://me:hunter2@[a/db"}) {
    const auto hosts = SplitHosts(connection);
    ASSERT_FALSE(hosts) << connection;
    EXPECT_EQ(hosts.error().text.find("hunter2"), std::string::npos) << hosts.error().text;
  }
}

}  // namespace
}  // namespace axlecast::db
