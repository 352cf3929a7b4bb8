#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace axlecast {

// The connections of a web server: who may open one, and which one takes too long. Pure: time is an argument.
//
// A connection waits for a whole request (also while TLS is agreed on, and between two requests), or its answer is on
// the way, or it is a WebSocket. When an address or the server has as many as it may have, the one that has waited
// longest is closed for the newcomer: those who trickle keep nobody out.
class WebConnections {
 public:
  struct Limits {
    std::size_t total = 64;
    std::size_t per_address = 32;  // of another host; this host may have all
  };
  static constexpr MonoNs kRequest = 15 * kSecond;    // for a whole request, from the accept or the answer before
  static constexpr MonoNs kAnswer = 60 * kSecond;     // for a peer to take its answer
  static constexpr MonoNs kSlowAnswer = 5 * kSecond;  // an answer that takes longer gives way to newcomers

  using Id = const void*;
  struct Admission {
    bool admitted = false;
    Id close = nullptr;  // not null: close this one
  };

  explicit WebConnections(Limits limits) : limits_(limits) {}

  // Decides about a newcomer. What is to be closed counts no longer.
  [[nodiscard]] Admission Admit(const std::string& address, MonoNs now);
  void Add(Id id, const std::string& address, MonoNs now);
  void Remove(Id id) { connections_.erase(id); }

  void OnWholeRequest(Id id, MonoNs now) { Enter(id, Phase::kAnswer, now); }
  void OnAnswered(Id id, MonoNs now) { Enter(id, Phase::kRequest, now); }
  void OnWebSocket(Id id, MonoNs now) { Enter(id, Phase::kWebSocket, now); }

  // Those to close: their deadline has passed, or Admit has named them. Named again until they are removed.
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

// What counts as one address: a host's IPv4 address, its network of 64 bits in IPv6; "" for this host.
// `text` as inet_ntop writes it.
[[nodiscard]] std::string WebAddressKey(const std::string& text);

}  // namespace axlecast
