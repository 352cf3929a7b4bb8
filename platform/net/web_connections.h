#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace axlecast {

// The connections of a web server: limits their number and duration. Time is an argument.
//
// A connection waits for a complete request (also during the TLS handshake, and between two requests), or its answer is being
// sent, or it is a WebSocket. If an address or the server has reached its limit, the connection that has waited longest is closed
// for a new one. Slow clients therefore do not block others.
class WebConnections {
 public:
  struct Limits {
    std::size_t total = 64;
    std::size_t per_address = 32;  // of another host; this host has no limit
  };
  static constexpr MonoNs kRequest = 15 * kSecond;    // for a complete request, from the accept or the last answer
  static constexpr MonoNs kAnswer = 60 * kSecond;     // for a peer to take its answer
  static constexpr MonoNs kSlowAnswer = 5 * kSecond;  // a slower answer may be closed for a new connection

  using Id = const void*;
  struct Admission {
    bool admitted = false;
    Id close = nullptr;  // not null: close this one
  };

  explicit WebConnections(Limits limits) : limits_(limits) {}

  // Decides about a new connection. A connection to close is not counted any more.
  [[nodiscard]] Admission Admit(const std::string& address, MonoNs now);
  void Add(Id id, const std::string& address, MonoNs now);
  void Remove(Id id) { connections_.erase(id); }

  void OnWholeRequest(Id id, MonoNs now) { Enter(id, Phase::kAnswer, now); }
  void OnAnswered(Id id, MonoNs now) { Enter(id, Phase::kRequest, now); }
  void OnWebSocket(Id id, MonoNs now) { Enter(id, Phase::kWebSocket, now); }

  // Returns the connections to close: their deadline has passed, or Admit has returned them. Repeated until they are removed.
  [[nodiscard]] std::vector<Id> ToClose(MonoNs now);

 private:
  enum class Phase : std::uint8_t { kRequest, kAnswer, kWebSocket, kClosing };
  struct Connection {
    std::string address;
    Phase phase = Phase::kRequest;
    MonoNs since = 0;
  };
  using Table = std::map<Id, Connection>;

  void Enter(Id id, Phase phase, MonoNs now);
  [[nodiscard]] std::size_t Count(const std::string* address) const;
  [[nodiscard]] Table::iterator Slowest(const std::string* address, MonoNs now);

  Limits limits_;
  Table connections_;
};

// Returns what counts as one address: the IPv4 address of a host, or its /64 network in IPv6; "" for this host. `text`: as from
// inet_ntop.
[[nodiscard]] std::string WebAddressKey(const std::string& text);

}  // namespace axlecast
