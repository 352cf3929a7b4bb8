#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/messages/broker_link.h"
#include "platform/net/mqtt_link.h"

namespace axlecast {

// The frames between `axlecast mqtt` and the process that runs libmosquitto: a length and a body, in the host's byte order.
// Both ends are the same program. A broker may have damaged the other process: its frames are checked like untrusted input.

struct LinkCommand {
  enum class Kind : std::uint8_t { kConnect, kSend, kSubscribe, kDisconnect };
  Kind kind = Kind::kDisconnect;
  MqttLinkSettings settings = {};  // kConnect
  BrokerMessage message = {};      // kConnect: the will; kSubscribe: the topic filter is its topic
  std::int32_t id = 0;             // kSend, kSubscribe: the number in events
  bool publish_will = false;       // kDisconnect
};

[[nodiscard]] std::string EncodeCommand(const LinkCommand& command);
[[nodiscard]] std::optional<LinkCommand> DecodeCommand(std::string_view body);

[[nodiscard]] std::string EncodeEvent(const BrokerEvent& event);
[[nodiscard]] std::optional<BrokerEvent> DecodeEvent(std::string_view body);

// Splits a stream of frames into their bodies.
class FrameBuffer {
 public:
  // A frame is bad if it announces more than `maximum` bytes.
  explicit FrameBuffer(std::size_t maximum) : maximum_(maximum) {}

  void Add(std::string_view bytes) { bytes_ += bytes; }
  [[nodiscard]] std::optional<std::string> Next();
  [[nodiscard]] bool bad() const { return bad_; }

 private:
  std::size_t maximum_;
  std::string bytes_;
  bool bad_ = false;
};

}  // namespace axlecast
