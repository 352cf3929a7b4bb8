#include "core/messages/lcm_url.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(ParseLcmUrl, TakesGroupPortAndOptions) {
  const LcmUrl url = *ParseLcmUrl("udpm://239.255.76.67:7668?ttl=1&recv_buf_size=2097152");
  EXPECT_EQ(url.group, "239.255.76.67");
  EXPECT_EQ(url.port, 7668);
  EXPECT_EQ(url.ttl, 1);
  EXPECT_EQ(url.recv_buf_size, 2'097'152);
  EXPECT_FALSE(url.in_process);
  EXPECT_EQ(ParseLcmUrl("udpm://224.0.0.1:1")->ttl, 0) << "LCM's default";
  EXPECT_TRUE(ParseLcmUrl("memq://")->in_process);
}

TEST(ParseLcmUrl, RefusesWhatLcmWouldPassOver) {
  for (const char* url : {"",
                          "udpm",
                          "udp://239.255.76.67:7667",
                          "udpm://",
                          "udpm://:7667",
                          "udpm://239.255.76.67",
                          "udpm://239.255.76.67:",
                          "udpm://239.255.76.67:0",
                          "udpm://239.255.76.67:65536",
                          "udpm://239.255.76.67:76x",
                          "udpm://10.1.2.3:7667",
                          "udpm://240.0.0.1:7667",
                          "udpm://localhost:7667",
                          "udpm://239.255.76.67:7667?ttl",
                          "udpm://239.255.76.67:7667?ttl=-1",
                          "udpm://239.255.76.67:7667?ttl=256",
                          "udpm://239.255.76.67:7667?ttl=1&x=2",
                          "udpm://239.255.76.67:7667?recv_buf_size=1",
                          "tcpq://localhost:7700",
                          "file://log",
                          "memq://x"}) {
    EXPECT_FALSE(ParseLcmUrl(url)) << url;
  }
}

TEST(IsOtherProvider, IsWhatOnlyToolsRead) {
  EXPECT_TRUE(IsOtherProvider("tcpq://localhost:7700"));
  EXPECT_TRUE(IsOtherProvider("file:///tmp/a.log?mode=r"));
  EXPECT_FALSE(IsOtherProvider("udpm://239.255.76.67:7667"));
  EXPECT_FALSE(IsOtherProvider("memq://"));
  EXPECT_FALSE(IsOtherProvider("/tmp/a.log"));
}

}  // namespace

}  // namespace axlecast
