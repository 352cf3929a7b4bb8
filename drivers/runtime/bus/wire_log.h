#pragma once

#include <axlecast/wire_t.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "core/base/time.h"
#include "core/command/command_id.h"
#include "core/device/step.h"
#include "core/messages/message.h"

namespace axlecast {

// Records the events of one bus as wire_t on "WIRE/<bus>": a message is sent when the next event would
// lengthen it beyond 1300 bytes, or 10 ms after its first event. An exchange never spans two messages, so that a
// lost message costs only its own events. Fixed buffers; allocates nothing after construction.
class WireLog {
 public:
  static constexpr std::size_t kFlushBytes = 1300;
  static constexpr MonoNs kFlushAfter = 10 * kMillisecond;

  // What stands in wire_t: the kind of bus, and of SPI its clock.
  struct Kind {
    std::int8_t kind = wire_t::KIND_SERIAL;
    std::int32_t clock_hz = 0;
  };
  WireLog(const std::string& bus, std::int64_t boot_id, const Timebase& time, MessageSink& sink, Kind kind);

  void Record(const Event& event);
  void FlushIfDue(MonoNs now) {
    if (now >= due_) Flush();
  }
  void Flush();
  [[nodiscard]] MonoNs due() const { return due_; }

 private:
  [[nodiscard]] std::int32_t IdOf(const Event& event) const;
  [[nodiscard]] bool Add(const Event& event, Interval at, std::int8_t direction, Bytes bytes);

  const Timebase& time_;
  MessageSink& sink_;
  const Kind kind_;
  std::string channel_;
  wire_t message_;        // its records are all there; message_.n of them are in use
  std::size_t size_ = 0;  // bytes of the message so far
  MonoNs due_ = kNever;
};

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
