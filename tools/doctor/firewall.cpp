#include "tools/doctor/firewall.h"

#include <arpa/inet.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

namespace axlecast {
namespace {

using Json = nlohmann::json;

enum class Match : std::uint8_t { kNo, kPerhaps, kYes };
enum class RuleVerdict : std::uint8_t { kNone, kPass, kDrop };  // kPass: accepted, or perhaps accepted

constexpr int kDeepest = 16;        // of chains that jump to one another, as the kernel has it
constexpr int kMaxRules = 100'000;  // that are looked at for one packet

std::string Text(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

bool InNetwork(const std::string& address, const std::string& network, unsigned length) {
  in_addr left{};
  in_addr right{};
  if (inet_pton(AF_INET, address.c_str(), &left) != 1 || inet_pton(AF_INET, network.c_str(), &right) != 1)
    return false;
  const std::uint32_t mask = length == 0 ? 0 : ~std::uint32_t{0} << (32 - std::min(length, 32U));
  return ((ntohl(left.s_addr) ^ ntohl(right.s_addr)) & mask) == 0;
}

Match Holds(const Json& value, const Json& right);

Match HoldsAny(const Json& value, const Json& elements) {
  Match best = Match::kNo;
  for (const Json& element : elements) best = std::max(best, Holds(value, element));
  return best;
}

// Whether a value of the packet is the right side of a match: a literal, a set, a range or a prefix.
Match Holds(const Json& value, const Json& right) {
  if (right.is_array()) return HoldsAny(value, right);
  if (right.is_string() && right.get_ref<const std::string&>().starts_with('@'))
    return Match::kPerhaps;  // a named set
  if (right.is_primitive()) return value == right ? Match::kYes : Match::kNo;
  if (const auto set = right.find("set"); set != right.end() && set->is_array()) return HoldsAny(value, *set);
  if (const auto range = right.find("range"); range != right.end() && range->is_array() && range->size() == 2) {
    if (!value.is_number() || !(*range)[0].is_number() || !(*range)[1].is_number()) return Match::kPerhaps;
    return (*range)[0] <= value && value <= (*range)[1] ? Match::kYes : Match::kNo;
  }
  if (const auto prefix = right.find("prefix"); prefix != right.end() && prefix->is_object()) {
    const auto length = prefix->find("len");
    if (!value.is_string() || length == prefix->end() || !length->is_number_unsigned()) return Match::kPerhaps;
    return InNetwork(value.get<std::string>(), Text(*prefix, "addr"), length->get<unsigned>()) ? Match::kYes
                                                                                               : Match::kNo;
  }
  return Match::kPerhaps;
}

// What the packet has at the left side of a match; null: not known.
Json ValueOf(const Json& left, const FirewallPacket& packet) {
  if (!left.is_object()) return nullptr;
  if (const auto meta = left.find("meta"); meta != left.end() && meta->is_object()) {
    const std::string key = Text(*meta, "key");
    if (key == "l4proto") return "udp";
    if (key == "nfproto") return "ipv4";
    if ((key == "iif" || key == "iifname") && !packet.interface.empty()) return packet.interface;
    return nullptr;
  }
  // Nobody answers a multicast: to the kernel each packet is the first of its connection.
  if (const auto ct = left.find("ct"); ct != left.end() && ct->is_object() && Text(*ct, "key") == "state")
    return "new";
  const auto payload = left.find("payload");
  if (payload == left.end() || !payload->is_object()) return nullptr;
  const std::string protocol = Text(*payload, "protocol");
  const std::string field = Text(*payload, "field");
  if ((protocol == "udp" || protocol == "th") && field == "dport") return packet.port;
  if (protocol == "ip" && field == "daddr") return packet.group;
  if (protocol == "ip" && field == "protocol") return "udp";
  return nullptr;
}

// What belongs to another protocol is in no such packet.
bool IsForeign(const Json& left) {
  if (!left.is_object() || !left.contains("payload") || !left["payload"].is_object()) return false;
  const std::string protocol = Text(left["payload"], "protocol");
  return protocol == "tcp" || protocol == "icmp" || protocol == "icmpv6" || protocol == "ip6";
}

Match MatchOf(const Json& match, const FirewallPacket& packet) {
  const auto left = match.find("left");
  const auto right = match.find("right");
  if (left == match.end() || right == match.end()) return Match::kPerhaps;
  if (IsForeign(*left)) return Match::kNo;
  const Json value = ValueOf(*left, packet);
  if (value.is_null()) return Match::kPerhaps;
  const Match holds = Holds(value, *right);
  const std::string op = Text(match, "op");
  if (op == "==" || op == "in") return holds;
  if (op != "!=" || holds == Match::kPerhaps) return Match::kPerhaps;
  return holds == Match::kYes ? Match::kNo : Match::kYes;
}

struct Place {
  std::string family, table, chain;
  friend bool operator==(const Place&, const Place&) = default;
};

class Ruleset {
 public:
  Ruleset(const Json& objects, const FirewallPacket& packet) : objects_(objects), packet_(packet) {}

  [[nodiscard]] RuleVerdict Walk(const Place& place, int depth) {
    if (depth > kDeepest) return RuleVerdict::kPass;
    for (const Json& object : objects_) {
      const auto rule = object.find("rule");
      if (++seen_ > kMaxRules) return RuleVerdict::kPass;
      if (rule == object.end() || !rule->is_object()) continue;
      if (Place{Text(*rule, "family"), Text(*rule, "table"), Text(*rule, "chain")} != place) continue;
      const auto expressions = rule->find("expr");
      if (expressions == rule->end() || !expressions->is_array()) continue;
      bool returns = false;
      const RuleVerdict verdict = Judge(*expressions, place, depth, returns);
      if (verdict != RuleVerdict::kNone) return verdict;
      if (returns) break;
    }
    return RuleVerdict::kNone;
  }

 private:
  // One rule. `returns`: the rest of the chain does not count.
  RuleVerdict Judge(const Json& expressions, const Place& place, int depth, bool& returns) {
    Match match = Match::kYes;
    for (const Json& expression : expressions) {
      if (!expression.is_object() || expression.empty()) return RuleVerdict::kNone;
      const std::string kind = expression.begin().key();
      const Json& content = expression.begin().value();
      if (kind == "counter" || kind == "log") continue;
      if (kind == "match") {
        match = std::min(match, content.is_object() ? MatchOf(content, packet_) : Match::kPerhaps);
        if (match == Match::kNo) return RuleVerdict::kNone;
      } else if (kind == "vmap") {
        return Choose(content, match, place, depth, returns);
      } else if (IsVerdict(kind)) {
        return Apply(kind, content, match, place, depth, returns);
      } else {
        match = Match::kPerhaps;  // a limit, iptables' extensions, ...
      }
    }
    return RuleVerdict::kNone;
  }

  static bool IsVerdict(const std::string& kind) {
    return kind == "accept" || kind == "drop" || kind == "reject" || kind == "return" || kind == "jump" ||
           kind == "goto";
  }

  RuleVerdict Apply(const std::string& kind, const Json& content, Match match, const Place& place, int depth,
                    bool& returns) {
    const bool sure = match == Match::kYes;
    if (kind == "accept") return RuleVerdict::kPass;
    if (kind == "drop" || kind == "reject") return sure ? RuleVerdict::kDrop : RuleVerdict::kNone;
    if (kind == "return") {
      returns = sure;
      return sure ? RuleVerdict::kNone : RuleVerdict::kPass;
    }
    if (!content.is_object()) return RuleVerdict::kPass;
    const RuleVerdict verdict = Walk({place.family, place.table, Text(content, "target")}, depth + 1);
    returns = kind == "goto" && sure;
    return verdict == RuleVerdict::kDrop && !sure ? RuleVerdict::kNone : verdict;
  }

  // A verdict map: the verdict that stands at the packet's value.
  RuleVerdict Choose(const Json& map, Match match, const Place& place, int depth, bool& returns) {
    if (!map.is_object() || !map.contains("key") || !map.contains("data") || !map["data"].is_object() ||
        !map["data"].contains("set") || !map["data"]["set"].is_array()) {
      return RuleVerdict::kPass;
    }
    const Json value = ValueOf(map["key"], packet_);
    if (value.is_null()) return IsForeign(map["key"]) ? RuleVerdict::kNone : RuleVerdict::kPass;
    for (const Json& pair : map["data"]["set"]) {
      if (!pair.is_array() || pair.size() != 2 || !pair[1].is_object() || pair[1].empty())
        return RuleVerdict::kPass;
      const Match holds = std::min(match, Holds(value, pair[0]));
      if (holds == Match::kNo) continue;
      const auto verdict = pair[1].begin();
      return IsVerdict(verdict.key()) ? Apply(verdict.key(), verdict.value(), holds, place, depth, returns)
                                      : RuleVerdict::kNone;
    }
    return RuleVerdict::kNone;
  }

  const Json& objects_;
  const FirewallPacket& packet_;
  int seen_ = 0;
};

bool IsInput(const Json& chain) {
  const std::string family = Text(chain, "family");
  return Text(chain, "hook") == "input" && (family == "inet" || family == "ip");
}

}  // namespace

std::optional<FirewallChain> DroppingChain(const std::string& ruleset, const FirewallPacket& packet) {
  const Json root = Json::parse(ruleset, nullptr, false);
  if (!root.is_object() || !root.contains("nftables") || !root["nftables"].is_array()) return std::nullopt;
  const Json& objects = root["nftables"];
  Ruleset rules(objects, packet);
  for (const Json& object : objects) {
    if (!object.is_object()) return std::nullopt;
  }
  for (const Json& object : objects) {
    const auto chain = object.find("chain");
    if (chain == object.end() || !chain->is_object() || !IsInput(*chain)) continue;
    const Place place{Text(*chain, "family"), Text(*chain, "table"), Text(*chain, "name")};
    RuleVerdict verdict = rules.Walk(place, 0);
    if (verdict == RuleVerdict::kNone && Text(*chain, "policy") == "drop") verdict = RuleVerdict::kDrop;
    if (verdict == RuleVerdict::kDrop) return FirewallChain{place.family, place.table, place.chain};
  }
  return std::nullopt;
}

}  // namespace axlecast
