#include "platform/db/timeline.h"

#include <gtest/gtest.h>

#include <array>

namespace axlecast::db {
namespace {

TEST(Timeline, FirstOfEqualServersIsChosen) {
  Timelines seen;
  const std::array<ServerTimeline, 2> servers = {{{"7", 3}, {"7", 3}}};
  EXPECT_EQ(ChooseServer(servers, seen), 0U);
  EXPECT_EQ(seen, (Timelines{{"7", 3}}));
}

TEST(Timeline, OldPrimaryIsNotChosen) {
  Timelines seen;
  const std::array<ServerTimeline, 2> servers = {{{"7", 3}, {"7", 4}}};
  EXPECT_EQ(ChooseServer(servers, seen), 1U);
  // Later it is the only one that answers.
  EXPECT_EQ(ChooseServer(std::span(servers).first(1), seen), std::nullopt);
  const std::string text = OldPrimaryText("db1:5432/axlecast", servers[0], seen);
  EXPECT_NE(text.find("db1:5432/axlecast is an old primary: it writes timeline 3, and timeline 4 exists"),
            std::string::npos)
      << text;
}

TEST(Timeline, OtherClustersAndUnknownTimelinesAreNotCompared) {
  Timelines seen{{"7", 4}};
  const std::array<ServerTimeline, 1> other = {{{"8", 1}}};  // a database that was moved to a new server
  EXPECT_EQ(ChooseServer(other, seen), 0U);
  const std::array<ServerTimeline, 1> unknown = {{{"", 0}}};
  EXPECT_EQ(ChooseServer(unknown, seen), 0U);
  EXPECT_EQ(ChooseServer({}, seen), std::nullopt);
  EXPECT_EQ(seen, (Timelines{{"7", 4}, {"8", 1}}));
}

}  // namespace
}  // namespace axlecast::db
