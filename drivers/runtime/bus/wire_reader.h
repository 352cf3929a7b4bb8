#pragma once

#include <axlecast/wire_t.hpp>
#include <cstdint>
#include <functional>

#include "core/device/step.h"

namespace axlecast {

// The way back from a WIRE channel: the events that WireLog recorded, with the same bytes and instants, for a fresh
// device to decode again.
class WireReader {
 public:
  using Sink = std::function<void(const Event&)>;

  // Hands over the events of one message, in order; their spans live in the message.
  void Read(const wire_t& message, const Sink& sink);

  // Messages that are missing by the gaps in their sequence numbers.
  [[nodiscard]] std::int64_t lost_messages() const { return lost_messages_; }
  // Records that are none of those of wire_record_t, or do not fit together.
  [[nodiscard]] std::int64_t unreadable() const { return unreadable_; }

 private:
  void Follow(const wire_t& message);

  std::int64_t boot_id_ = 0;
  std::int64_t next_seq_ = -1;  // -1: any
  std::int64_t lost_messages_ = 0;
  std::int64_t unreadable_ = 0;
};

}  // namespace axlecast
