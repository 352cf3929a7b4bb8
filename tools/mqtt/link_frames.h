#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/messages/broker_link.h"
#include "platform/net/mqtt_link.h"

namespace axlecast {

// What `axlecast mqtt` and the process that holds libmosquitto send each other: frames of a length and a body, both in the
// host's byte order. Both ends are the same program, but the link's process may have been damaged by a broker: its frames
// are checked like a stranger's.

struct LinkCommand {
  enum class Kind : std::uint8_t { kConnect, kSend, kDisconnect };
  Kind kind = Kind::kDisconnect;
  MqttLinkSettings settings = {};  // kConnect
  BrokerMessage message = {};      // kConnect: the will
  std::int32_t id = 0;             // kSend: events name the message by it
};

[[nodiscard]] std::string EncodeCommand(const LinkCommand& command);
[[nodiscard]] std::optional<LinkCommand> DecodeCommand(std::string_view body);

[[nodiscard]] std::string EncodeEvent(const BrokerEvent& event);
[[nodiscard]] std::optional<BrokerEvent> DecodeEvent(std::string_view body);

// The bodies of a stream of frames.
class FrameBuffer {
 public:
  // A frame that announces more than `longest` bytes is bad.
  explicit FrameBuffer(std::size_t longest) : longest_(longest) {}

  void Add(std::string_view bytes) { bytes_ += bytes; }
  [[nodiscard]] std::optional<std::string> Next();
  [[nodiscard]] bool bad() const { return bad_; }

 private:
  std::size_t longest_;
  std::string bytes_;
  bool bad_ = false;
};

}  // namespace axlecast
