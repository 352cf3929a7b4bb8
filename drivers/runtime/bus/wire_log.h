#pragma once

#include <axlecast/wire_t.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "core/base/time.h"
#include "core/command/commands.h"
#include "core/device/step.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {

// Records the events of one bus as wire_t on "WIRE/<bus>". A message is sent before it would exceed 1300 bytes, or 10 ms
// after its first event. An exchange is never split between two messages, so a lost message loses only its own events.
// Allocates nothing after construction.
class WireLog {
 public:
  static constexpr std::size_t kFlushBytes = 1300;
  static constexpr MonoNs kFlushAfter = 10 * kMillisecond;

  // The kind of bus in wire_t, and the clock of SPI.
  struct Kind {
    std::int8_t kind = wire_t::KIND_SERIAL;
    std::int32_t clock_hz = 0;
  };
  WireLog(const std::string& bus, const Origin& origin, const Timebase& time, MessageSink& sink, Kind kind);

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
  wire_t message_;        // all records are allocated; message_.n of them are used
  std::size_t size_ = 0;  // bytes of the message so far
  MonoNs due_ = kNever;
};

// Restores the events that WireLog recorded, with the same bytes and timestamps, so that a new device can decode them.
class WireReader {
 public:
  using Sink = std::function<void(const Event&)>;

  // Passes the events of one message to `sink`, in order. Their spans point into the message.
  void Read(const wire_t& message, const Sink& sink);

  // Returns how many records are not valid, or do not fit together.
  [[nodiscard]] std::int64_t unreadable() const { return unreadable_; }

 private:
  std::int64_t unreadable_ = 0;
};

}  // namespace axlecast
