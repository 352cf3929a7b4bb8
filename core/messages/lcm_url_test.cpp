#include "core/messages/lcm_url.h"

#include <gtest/gtest.h>

#include <string>

namespace axlecast {
namespace {

TEST(ParseLcmUrl, TakesGroupPortAndOptions) {
  const LcmUrl url = *ParseLcmUrl("udpm://239.255.76.67:7668?ttl=1&recv_buf_size=2097152");
  EXPECT_EQ(url.group, "239.255.76.67");
  EXPECT_EQ(url.port, 7668);
  EXPECT_EQ(url.ttl, 1);
  EXPECT_EQ(url.recv_buf_size, 2'097'152);
  EXPECT_FALSE(url.in_process);
  EXPECT_EQ(url.interface, "");
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
                          "udpm://239.255.76.67:7667?interface=",
                          "udpm://239.255.76.67:7667?interface=eth1&interface=eth2",
                          "udpm://239.255.76.67:7667?interface=192.168.5.0/33",
                          "udpm://ff15::4c43:7667?interface=eth1",
                          "udpm://[ff15::4c43]:7667?ttl=1",
                          "udpm://[ff15::4c43]?interface=eth1",
                          "udpm://[ff15::4c43]7667?interface=eth1",
                          "udpm://[ff15::4c43:7667?interface=eth1",
                          "udpm://[ff12::1]:7667?interface=eth1",
                          "udpm://[fd00::1]:7667?interface=eth1",
                          "udpm://[239.255.76.67]:7667?interface=eth1",
                          "tcpq://localhost:7700",
                          "file://log",
                          "memq://x"}) {
    EXPECT_FALSE(ParseLcmUrl(url)) << url;
  }
}

TEST(ParseLcmUrl, TakesAnInterfaceAndAnIPv6Group) {
  const LcmUrl url = *ParseLcmUrl("udpm://[ff15::4c43]:7667?ttl=1&interface=eth1");
  EXPECT_EQ(url.group, "ff15::4c43");
  EXPECT_TRUE(url.IsIPv6());
  EXPECT_EQ(url.port, 7667);
  EXPECT_EQ(url.ttl, 1);
  EXPECT_EQ(url.interface, "eth1");
  EXPECT_FALSE(ParseLcmUrl("udpm://239.255.76.67:7667?interface=192.168.5.0/24")->IsIPv6());
}

TEST(ParseLcmUrl, StatesWhatIsMissing) {
  EXPECT_NE(ParseLcmUrl("udpm://[ff15::4c43]:7667").error().text.find("lcm: {interface: eth1}"), std::string::npos);
  EXPECT_NE(ParseLcmUrl("udpm://[ff12::1]:7667").error().text.find("use ff15::"), std::string::npos);
}

TEST(IsInterface, IsANameAnAddressOrANetwork) {
  for (const char* text : {"eth1", "enp3s0.100", "br-lan", "wlan0", "192.168.5.1", "fd00::1", "fe80::1",
                           "192.168.5.0/24", "fd00::/64", "0.0.0.0/1", "a@b"}) {
    EXPECT_TRUE(IsInterface(text)) << text;
  }
  for (const char* text : {"", ".", "..", "sixteencharacter", "eth 1", "eth1&ttl=1", "a/b", "eth0:1",
                           "192.168.5.0/0", "192.168.5.0/", "fd00::/129", "eth1\n", "/24"}) {
    EXPECT_FALSE(IsInterface(text)) << text;
  }
}

TEST(WithInterface, FollowsTheOtherOptions) {
  EXPECT_EQ(WithInterface("udpm://239.255.76.67:7667", "eth1"), "udpm://239.255.76.67:7667?interface=eth1");
  EXPECT_EQ(WithInterface("udpm://239.255.76.67:7667?ttl=1", "10.0.0.0/8"),
            "udpm://239.255.76.67:7667?ttl=1&interface=10.0.0.0/8");
  EXPECT_EQ(WithInterface("memq://", "eth1"), "memq://");
}

TEST(SenderText, IsTheAddressAndThePort) {
  EXPECT_EQ(SenderText(SenderAddress::OfIPv4(0x7F000001, 40'001)), "127.0.0.1:40001");
  SenderAddress sender{.address = {0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, .port = 7};
  EXPECT_EQ(SenderText(sender), "[fd00::1]:7");
}

TEST(SenderAddress, SortsByAddressAndThenByPort) {
  EXPECT_LT(SenderAddress::OfIPv4(0x0A000001, 9), SenderAddress::OfIPv4(0x0A000002, 1));
  EXPECT_LT(SenderAddress::OfIPv4(0x0A000001, 1), SenderAddress::OfIPv4(0x0A000001, 9));
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
