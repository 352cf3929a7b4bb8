// Rulesets as nft 1.0.6 prints them (`nft --json list ruleset`).

#include "tools/doctor/firewall.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

const FirewallPacket kFromNetwork{.group = "239.255.76.67", .port = 7667, .interface = "eth0"};

// The chain `input` of the table inet f with this policy, its rules' expressions, and other objects behind it.
std::string Ruleset(const std::string& policy, const std::vector<std::string>& rules,
                    const std::string& more = "") {
  std::string text =
      R"({"nftables":[{"metainfo":{"version":"1.0.6"}},{"table":{"family":"inet","name":"f","handle":1}},)"
      R"({"chain":{"family":"inet","table":"f","name":"input","type":"filter","hook":"input","prio":0,"policy":")" +
      policy + "\"}}";
  for (const std::string& rule : rules) {
    text += R"(,{"rule":{"family":"inet","table":"f","chain":"input","expr":[)" + rule + "]}}";
  }
  return text + more + "]}";
}

std::string Equals(const std::string& left, const std::string& right, const std::string& op = "==") {
  return R"({"match":{"op":")" + op + R"(","left":)" + left + R"(,"right":)" + right + "}}";
}

const std::string kPort = R"({"payload":{"protocol":"udp","field":"dport"}})";
const std::string kGroup = R"({"payload":{"protocol":"ip","field":"daddr"}})";
const std::string kInterface = R"({"meta":{"key":"iifname"}})";
const std::string kAccept = R"(,{"accept":null})";
const std::string kDrop = R"(,{"drop":null})";
const std::string kCount = R"({"counter":{"packets":0,"bytes":0}})";

struct RuleCase {
  const char* what;
  const char* policy;
  std::vector<std::string> rules;
  bool dropped;
};

TEST(Firewall, RulesAreJudgedForThePacket) {
  const RuleCase cases[] = {
      {"an open policy", "accept", {}, false},
      {"a closed policy", "drop", {}, true},
      {"lo alone is let in", "drop", {Equals(kInterface, "\"lo\"") + kAccept}, true},
      {"its port is let in", "drop", {Equals(kPort, "7667") + kAccept}, false},
      {"another port is", "drop", {Equals(kPort, "7669") + kAccept}, true},
      {"a set of ports is", "drop", {Equals(kPort, R"({"set":[22,7667]})") + kAccept}, false},
      {"a range of ports is", "drop", {Equals(kPort, R"({"range":[7000,8000]})") + kAccept}, false},
      {"another range is", "drop", {Equals(kPort, R"({"set":[{"range":[1,1024]}]})") + kAccept}, true},
      {"multicast is", "drop", {Equals(kGroup, R"({"prefix":{"addr":"224.0.0.0","len":4}})") + kAccept}, false},
      {"another net is", "drop", {Equals(kGroup, R"({"prefix":{"addr":"10.0.0.0","len":8}})") + kAccept}, true},
      {"all but one port are", "drop", {Equals(kPort, "53", "!=") + kAccept}, false},
      {"a named set, which is not known here, is", "drop", {Equals(kPort, "\"@mine\"") + kAccept}, false},
      {"established connections are",
       "drop",
       {Equals(R"({"ct":{"key":"state"}})", R"(["established","related"])", "in") + kAccept},
       true},
      {"a verdict map of states",
       "drop",
       {R"({"vmap":{"key":{"ct":{"key":"state"}},"data":{"set":[["established",{"accept":null}],["invalid",{"drop":null}]]}}})"},
       true},
      {"a verdict map that lets it in",
       "drop",
       {R"({"vmap":{"key":{"meta":{"key":"iifname"}},"data":{"set":[["eth0",{"accept":null}]]}}})"},
       false},
      {"TCP is", "drop", {Equals(R"({"payload":{"protocol":"tcp","field":"dport"}})", "7667") + kAccept}, true},
      {"TCP to all ports but one is",
       "drop",
       {Equals(R"({"payload":{"protocol":"tcp","field":"dport"}})", "22", "!=") + kAccept},
       true},
      {"its port is dropped", "accept", {Equals(kPort, "7667") + kDrop}, true},
      {"and counted", "accept", {kCount + "," + Equals(kPort, "7667") + "," + kCount + kDrop}, true},
      {"perhaps dropped is not said", "accept", {Equals(R"({"meta":{"key":"skuid"}})", "7") + kDrop}, false},
      {"what is not understood may let it in", "drop", {R"({"xt":null})" + kAccept}, false},
      {"rejected", "accept", {Equals(kGroup, "\"239.255.76.67\"") + R"(,{"reject":{"type":"icmp"}})"}, true},
      {"the first that fits counts",
       "drop",
       {Equals(kPort, "7667") + kAccept, Equals(kPort, "7667") + kDrop},
       false},
  };
  for (const RuleCase& one : cases) {
    EXPECT_EQ(DroppingChain(Ruleset(one.policy, one.rules), kFromNetwork).has_value(), one.dropped) << one.what;
  }
}

TEST(Firewall, JumpsAreFollowed) {
  const std::string chain = R"(,{"chain":{"family":"inet","table":"f","name":"plant"}})";
  const auto rule = [](const std::string& expressions) {
    return R"(,{"rule":{"family":"inet","table":"f","chain":"plant","expr":[)" + expressions + "]}}";
  };
  const std::string jump = R"({"jump":{"target":"plant"}})";
  const std::string with_accept = chain + rule(Equals(kPort, "7667") + kAccept);
  EXPECT_FALSE(DroppingChain(Ruleset("drop", {jump}, with_accept), kFromNetwork));
  EXPECT_TRUE(DroppingChain(Ruleset("accept", {jump}, chain + rule(Equals(kPort, "7667") + kDrop)), kFromNetwork));
  EXPECT_TRUE(DroppingChain(
      Ruleset("drop", {jump}, chain + rule(R"({"return":null})") + rule(Equals(kPort, "7667") + kAccept)),
      kFromNetwork));
  const std::string loop = chain + rule(jump);
  EXPECT_FALSE(DroppingChain(Ruleset("drop", {jump}, loop), kFromNetwork)) << "ends, and says nothing";
}

TEST(Firewall, TheChainIsNamed) {
  const auto chain = DroppingChain(Ruleset("drop", {}), kFromNetwork);
  ASSERT_TRUE(chain);
  EXPECT_EQ(chain->family + ' ' + chain->table + ' ' + chain->name, "inet f input");
}

TEST(Firewall, WhatIsNoRulesetSaysNothing) {
  for (const char* text : {"", "{", "[]", "{}", R"({"nftables":{}})", R"({"nftables":[7]})",
                           R"({"nftables":[{"chain":7},{"rule":{"expr":7}}]})",
                           R"({"nftables":[{"chain":{"hook":"input","family":"ip6","policy":"drop"}}]})"}) {
    EXPECT_FALSE(DroppingChain(text, kFromNetwork)) << text;
  }
}

}  // namespace
}  // namespace axlecast
