#pragma once

#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"

namespace axlecast {

// What happened on a bus. Spans live only during the call that hands the event over.
// A recorded sequence of events, handed to a fresh device, gives the same readings: decoding uses the event alone.
struct Event {
  enum class Kind : std::uint8_t {
    kReply,        // the reply to `request` is complete
    kTimeout,      // the reply to `request` did not complete in time; `bytes` is what came
    kStray,        // `bytes` came without having been asked for
    kUnsolicited,  // `bytes` came while the device listened
    kSilent,       // no byte came for the time asked for
    kPulsed,       // the line was driven low and high again within `sent`
    kRetuned,      // the line goes on at the rate asked for
    kLinkUp,
    kLinkDown,
  };

  Kind kind = Kind::kSilent;
  Interval sent;      // before the write began, after it returned
  Interval received;  // return of the first and of the last read
  Bytes request;
  Bytes bytes;
  bool secret = false;  // request and bytes must not be shown
  int device = -1;      // whose step it ends, by order on the bus; -1: an event of the whole bus
};

}  // namespace axlecast
