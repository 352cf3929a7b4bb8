#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/device/can.h"

namespace axlecast {

// The priority of a step on the bus. Lower values come first.
enum class Priority : std::uint8_t { kStop, kCommand, kLive, kTrip, kSlow };

// Length of the reply that begins with `so_far`: its total bytes, or 0 while more bytes are needed to determine it.
using ReplyLength = std::size_t (*)(Bytes so_far);

template <std::size_t N>
constexpr std::size_t FixedLength(Bytes) {
  return N;
}

// Returns where the reply begins in `so_far`, after bytes that do not belong to it; so_far.size() if it has not begun.
using ReplyBegin = std::size_t (*)(Bytes so_far);

// How received bytes relate to a request.
enum class ReplyMatch : std::uint8_t {
  kNo,       // not its reply, or a part of it
  kNearly,   // begins almost as its reply begins: too damaged to be distinguished from the reply to another request
  kDamaged,  // begins as its reply begins and has its length, but fails the checksum
  kRefusal,  // complete, and reports that a request failed, but not which one
  kYes,      // its reply
};
using MatchReply = ReplyMatch (*)(Bytes request, Bytes reply);

// The properties that distinguish the replies of a bus, so that a late reply is not mistaken for the reply to another
// request (drivers/runtime/bus/stale_reply_guard.h). A family that leaves it as it is gets one exchange at a time.
struct ReplyShape {
  std::uint32_t reply = 0;     // equal for requests whose replies cannot be distinguished
  std::uint32_t refusal = 0;   // `reply` of those whose replies look like a refusal of this one, or any number
  MatchReply match = nullptr;  // null: every complete reply is its own
  // A late reply to an earlier request of the same shape is as good: nothing depends on when it was made.
  bool interchangeable = false;
  // Not even a refusal of another request may be taken for its own.
  bool exact = false;
  // No request of this shape is under way from an earlier process: its reply shows that all those have been answered.
  bool fresh = false;
};

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
  // Transmit even if the line is not idle: unexpected bytes are reported first, and the request follows. It also goes
  // before the idle line that other devices wait for.
  bool regardless = false;
  ReplyShape shape = {};
  ReplyBegin reply_begin = nullptr;  // null: with the first byte that comes
};

// Transmit one CAN frame. Ends as kSent when it is in the controller's queue, as kNotSent when that is full; kConfirmed
// comes later, when a node has acknowledged it.
struct Send {
  CanFrame frame;
  bool for_all = false;  // all devices of the bus that are read on request sample when it is on the wire: SYNC
};

// Transmit nothing until the line has been idle for `quiet`. Bytes in the meantime are reported as unexpected. Ends as
// kSilent.
struct WaitForIdleLine {
  MonoNs quiet = 0;
};

// Receive unsolicited data until `until`. Each read ends as kUnsolicited, on CAN each frame as kFrame; kSilent when
// nothing came.
struct Listen {
  MonoNs until = 0;
};

// Change to another baud rate. Ends as kBaudRateSet, or as kLinkDown when the port cannot do it.
struct SetBaudRate {
  std::int64_t baud = 0;
};

// Nothing to do before `until`; a command may come earlier.
struct Idle {
  MonoNs until = kNever;
};

// The step that a device requests from its bus.
struct Step {
  std::variant<Idle, Exchange, Send, WaitForIdleLine, Listen, Pulse, SetBaudRate> action;
  Priority priority = Priority::kLive;
};

// What happened on a bus. Spans live only during the call that hands the event over. CAN frames, received and own, are
// passed to every device of the bus, as are link changes and unexpected bytes; all others to the device whose step ends.
// A recorded sequence of events, handed to a fresh device, gives the same readings: decoding uses the event alone.
struct Event {
  enum class Kind : std::uint8_t {
    kReply,            // the reply to `request` is complete
    kTimeout,          // the reply to `request` did not complete in time; `bytes` is what came
    kUnexpectedBytes,  // `bytes` arrived without a request
    kUnsolicited,      // `bytes` came while the device listened
    kSilent,           // no byte arrived during the requested time
    kPulsed,           // the line was driven low and high again within `sent`
    kBaudRateSet,      // the line uses the requested rate
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

  // Returns the time at which it was over.
  [[nodiscard]] constexpr MonoNs End() const { return std::max(sent.last, received.last); }

  // Returns the interval in which a polled device acted, or sampled its position: after the last character of the
  // request, and before the first of a reply of `reply_size` characters. `character`: time of one on the wire; 0 where
  // the wire is simulated and may be faster than a real one.
  [[nodiscard]] constexpr Interval ActedWithin(std::size_t reply_size, MonoNs character) const {
    const MonoNs earliest = sent.first + static_cast<MonoNs>(request.size()) * character;
    // The first read returned at least one character, the last read all of them.
    const MonoNs latest =
        std::min(received.first - character, received.last - static_cast<MonoNs>(reply_size) * character);
    return {earliest, std::max(earliest, latest)};
  }

  // Returns true for an event about a CAN frame.
  [[nodiscard]] static constexpr bool IsFrame(Kind kind) {
    return kind == Kind::kFrame || kind == Kind::kSent || kind == Kind::kNotSent || kind == Kind::kConfirmed;
  }
  // Returns true for an event that every device of the bus receives.
  [[nodiscard]] static constexpr bool IsOfBus(Kind kind) {
    return IsFrame(kind) || kind == Kind::kUnexpectedBytes || kind == Kind::kLinkUp || kind == Kind::kLinkDown;
  }
};

}  // namespace axlecast
