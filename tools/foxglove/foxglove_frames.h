#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace axlecast {

// Frames of the Foxglove WebSocket protocol (subprotocols foxglove.sdk.v1 and foxglove.websocket.v1): texts are JSON, messages binary
// and little-endian. Source: github.com/foxglove/ws-protocol, docs/spec.md, before its removal; the same frames in foxglove-sdk.

// A channel as it is advertised. Its id is never used again.
struct FoxgloveChannel {
  std::uint32_t id = 0;
  std::string topic;        // "/POSITION/axis1"
  std::string schema_name;  // "axlecast/msg/Position"
  std::string schema;
};

enum class FoxgloveLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };

// `session_id`: a viewer clears its plots if it changes.
[[nodiscard]] std::string FoxgloveServerInfo(const std::string& name, const std::string& session_id);
[[nodiscard]] std::string FoxgloveAdvertise(const std::vector<const FoxgloveChannel*>& channels);
[[nodiscard]] std::string FoxgloveUnadvertise(const std::vector<std::uint32_t>& ids);
// `id`: a later status with it replaces this one.
[[nodiscard]] std::string FoxgloveStatus(FoxgloveLevel level, const std::string& message, const std::string& id);
// Returns the head of a binary message; the payload follows. `time_ns`: UNIX time.
[[nodiscard]] std::string FoxgloveMessageHead(std::uint32_t subscription, std::uint64_t time_ns);

struct FoxgloveSubscribe {
  struct One {
    std::uint32_t subscription = 0;  // the client's number
    std::uint32_t channel = 0;
    bool operator==(const One&) const = default;
  };
  std::vector<One> subscriptions;
};
struct FoxgloveUnsubscribe {
  std::vector<std::uint32_t> subscriptions;
};
// A request that this server does not offer: to publish, to call a service, to set parameters, and others.
struct FoxgloveUnsupported {
  std::string operation;
};
using FoxgloveRequest = std::variant<FoxgloveSubscribe, FoxgloveUnsubscribe, FoxgloveUnsupported>;

// Returns nothing if the text is not a request of the protocol.
[[nodiscard]] std::optional<FoxgloveRequest> ParseFoxgloveRequest(std::string_view text);

}  // namespace axlecast
