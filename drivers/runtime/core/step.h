#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "drivers/runtime/core/can_frame.h"
#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"

namespace axlecast {

// Whose turn on a bus comes first. Lower values win.
enum class Priority : std::uint8_t { kStop, kCommand, kLive, kTrip, kSlow };

// Length of the reply that begins with `so_far`: its total bytes, or 0 while more bytes are needed to tell.
using ReplyLength = std::size_t (*)(Bytes so_far);

template <std::size_t N>
constexpr std::size_t FixedLength(Bytes) {
  return N;
}

// One pulse on an output line beside the bus: low for `low`, then high again.
struct Pulse {
  std::uint8_t line = 0;  // index into FamilyBus::lines
  MonoNs low = 0;
};

// Transmit `request` and collect a reply. Ends as kReply when the reply is complete, as kTimeout when `timeout`
// has passed since the write returned.
struct Exchange {
  Frame request;
  ReplyLength reply_length = nullptr;  // null: no reply is expected (a broadcast); ends as kTimeout
  MonoNs timeout = 0;
  std::optional<Pulse> pulse = {};  // what asks for the reply instead of a request, which is empty then
  bool secret = false;              // request and reply are masked in WIRE, and what may be a late reply
};

// Transmit one CAN frame. Ends as kSent when it is in the controller's queue, as kNotSent when that is full; kConfirmed
// comes later, when a node has acknowledged it.
struct Send {
  CanFrame frame;
};

// Transmit nothing until no byte has come for `quiet`; what comes is reported as stray. Ends as kSilent.
struct Silence {
  MonoNs quiet = 0;
};

// Receive what comes unasked until `until`. Each read ends as kUnsolicited, on CAN each frame as kFrame; kSilent when
// nothing came.
struct Listen {
  MonoNs until = 0;
};

// Go on at another baud rate. Ends as kRetuned, or as kLinkDown when the port cannot do it.
struct Retune {
  std::int64_t baud = 0;
};

// Nothing to do before `until`; a command may come earlier.
struct Idle {
  MonoNs until = kNever;
};

// What a device wants from its bus next.
struct Step {
  std::variant<Idle, Exchange, Send, Silence, Listen, Pulse, Retune> action;
  Priority priority = Priority::kLive;
};

}  // namespace axlecast
