#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace axlecast {

// A UDP packet to a multicast group as it comes in.
struct FirewallPacket {
  std::string group;
  std::int64_t port = 0;
  std::string interface;  // by which it comes; empty: not known
};

struct FirewallChain {
  std::string family;  // inet, ip
  std::string table;
  std::string name;
};

// The chain at the input hook of `ruleset` (libnftables-json(5); iptables' rules appear there too) that surely drops the
// packet. Rules whose match is not understood here count as accepting whatever they may accept: a hint, and no proof
// that all is well. Nothing for what is no ruleset.
[[nodiscard]] std::optional<FirewallChain> DroppingChain(const std::string& ruleset, const FirewallPacket& packet);

}  // namespace axlecast
