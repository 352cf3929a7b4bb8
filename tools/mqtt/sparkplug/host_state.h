#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace axlecast {

// A STATE message of a host application.
struct HostState {
  bool online = false;
  std::int64_t timestamp_ms = 0;  // ms, UNIX time
};

// Reads {"online": true, "timestamp": 1700000000000}; nothing if the text is something else.
[[nodiscard]] std::optional<HostState> ParseHostState(std::string_view json);

// Whether the primary host is online, from its STATE messages. A message that is older than the newest one is ignored: a
// delayed last will must not end a session.
class PrimaryHost {
 public:
  // Returns true if the host is online or offline otherwise than before.
  bool On(const HostState& state);
  [[nodiscard]] bool online() const { return online_; }
  // A new connection may lead to another broker: the host is offline until its STATE arrives.
  void Reset() { *this = PrimaryHost(); }

 private:
  bool online_ = false;
  std::optional<std::int64_t> newest_ms_;
};

}  // namespace axlecast
