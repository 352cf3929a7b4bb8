#pragma once

#include <cstdint>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"

namespace axlecast {

// What happened on a bus. Spans live only during the call that hands the event over. CAN frames, received and own, are
// told to every device of the bus, as are link changes and stray bytes; the rest to the device whose step it ends.
// A recorded sequence of events, handed to a fresh device, gives the same readings: decoding uses the event alone.
struct Event {
  enum class Kind : std::uint8_t {
    kReply,            // the reply to `request` is complete
    kTimeout,          // the reply to `request` did not complete in time; `bytes` is what came
    kUnexpectedBytes,  // `bytes` came without having been asked for
    kUnsolicited,      // `bytes` came while the device listened
    kSilent,           // no byte came for the time asked for
    kPulsed,           // the line was driven low and high again within `sent`
    kBaudRateSet,      // the line goes on at the rate asked for
    kFrame,            // a CAN frame came: `id`, `bytes`; with kCanError in its id the controller reports an error
    kSent,             // the frame `id`, `bytes` is in the controller's queue
    kNotSent,          // it is not: the queue is full
    kConfirmed,        // an own frame `id`, `bytes` was on the bus, and a node has acknowledged it
    kLinkUp,
    kLinkDown,
  };

  Kind kind = Kind::kSilent;
  Interval sent;  // before the write began, after it returned
  // Return of the read that brought the reply's own first byte, and of the last read. Of a CAN frame that came, the kernel's time of its arrival; of one that
  // was sent, how long handing it over took.
  Interval received;
  Bytes request;
  Bytes bytes;
  bool secret = false;   // request and bytes must not be shown
  std::uint32_t id = 0;  // of a CAN frame, with its flags
  bool early =
      false;        // kUnexpectedBytes: the wire cannot have carried it in reply to the request that was under way
  int device = -1;  // whose step it ends, by order on the bus; -1: an event of the whole bus

  // Whether it tells of a CAN frame.
  [[nodiscard]] static constexpr bool IsFrame(Kind kind) {
    return kind == Kind::kFrame || kind == Kind::kSent || kind == Kind::kNotSent || kind == Kind::kConfirmed;
  }
  // Whether every device of the bus is told.
  [[nodiscard]] static constexpr bool IsOfBus(Kind kind) {
    return IsFrame(kind) || kind == Kind::kUnexpectedBytes || kind == Kind::kLinkUp || kind == Kind::kLinkDown;
  }
};

}  // namespace axlecast
