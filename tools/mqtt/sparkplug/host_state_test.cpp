#include "tools/mqtt/sparkplug/host_state.h"

#include <gtest/gtest.h>

#include <string>

namespace axlecast {
namespace {

TEST(HostState, TheTextOfTheSpecification) {
  const auto online = ParseHostState(R"({"online":true,"timestamp":1668114759262})");
  ASSERT_TRUE(online);
  EXPECT_TRUE(online->online);
  EXPECT_EQ(online->timestamp_ms, 1'668'114'759'262);
  const auto offline = ParseHostState(R"({"timestamp":0,"online":false,"more":[1]})");
  ASSERT_TRUE(offline);
  EXPECT_FALSE(offline->online);
}

TEST(HostState, AnyOtherTextIsRefused) {
  for (const char* text :
       {"", "ONLINE", "OFFLINE", "[]", "true", "{}", R"({"online":true})", R"({"timestamp":1})",
        R"({"online":1,"timestamp":1})", R"({"online":true,"timestamp":"1"})", R"({"online":true,"timestamp":1.5})",
        R"({"online":true,"timestamp":-1})", R"({"online":true,"timestamp":18446744073709551615})",
        R"({"online":true,"timestamp":1)"}) {
    EXPECT_FALSE(ParseHostState(text)) << text;
  }
}

TEST(PrimaryHost, AnOlderMessageIsIgnored) {
  PrimaryHost host;
  EXPECT_FALSE(host.online());
  EXPECT_TRUE(host.On({true, 100}));
  EXPECT_FALSE(host.On({false, 99})) << "a delayed will of the session before";
  EXPECT_TRUE(host.online());
  EXPECT_FALSE(host.On({true, 100}));
  EXPECT_TRUE(host.On({false, 100})) << "the will of this session has its timestamp";
  EXPECT_FALSE(host.On({true, 99}));
  EXPECT_FALSE(host.online());
  EXPECT_TRUE(host.On({true, 100}));
}

TEST(PrimaryHost, ANewConnectionBeginsWithoutKnowledge) {
  PrimaryHost host;
  EXPECT_TRUE(host.On({true, 100}));
  host.Reset();
  EXPECT_FALSE(host.online());
  EXPECT_TRUE(host.On({true, 5})) << "another broker, another time";
}

}  // namespace
}  // namespace axlecast
