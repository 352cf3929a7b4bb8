#pragma once

#include <cstddef>
#include <variant>

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

// Transmit `request` and collect a reply. Ends as kReply when the reply is complete, as kTimeout when `timeout`
// has passed since the write returned.
struct Exchange {
  Frame request;
  ReplyLength reply_length = nullptr;
  MonoNs timeout = 0;
};

// Transmit nothing until no byte has come for `quiet`; what comes is reported as stray. Ends as kSilent.
struct Silence {
  MonoNs quiet = 0;
};

// Receive what comes unasked until `until`. Each read ends as kUnsolicited; kSilent when nothing came.
struct Listen {
  MonoNs until = 0;
};

// Nothing to do before `until`; a command may come earlier.
struct Idle {
  MonoNs until = kNever;
};

// What a device wants from its bus next.
struct Step {
  std::variant<Idle, Exchange, Silence, Listen> action;
  Priority priority = Priority::kLive;
};

}  // namespace axlecast
