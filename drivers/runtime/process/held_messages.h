#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/messages/message.h"

namespace axlecast {

// Keeps the messages of a reading until the next request is on the wire, so that the line does not wait for the network. Used where
// a request follows directly (poll_hz: 0). Sends in the order of Publish. Allocates nothing after the start, if channels have at most
// 200 characters. Used by the bus's thread.
class HeldMessages final : public MessageSink {
 public:
  explicit HeldMessages(MessageSink& sink);

  void Publish(const std::string& channel, Bytes message) override;
  // Sends what is held.
  void Release() {
    if (count_ > 0) SendAll();
  }

 private:
  struct Held {
    std::string channel;
    std::vector<std::uint8_t> message;
  };

  void SendAll();

  MessageSink& sink_;
  std::array<Held, 8> held_;
  std::size_t count_ = 0;
};

}  // namespace axlecast
