#pragma once

#include <cstdint>

namespace axlecast {

// A CAN controller and its interface, as the kernel tells it. Counts are since the link was opened.
struct CanController {
  // ISO 11898-1 10.12 and Linux (CAN_STATE_*): which errors it has seen on the bus lately.
  enum class State : std::uint8_t {
    kUnknown,  // the interface does not tell (vcan)
    kActive,   // error active, both counters below 96
    kWarning,  // a counter has reached 96
    kPassive,  // a counter has reached 128: it sends no active error flags any more
    kBusOff,   // the transmit counter has passed 255: it takes no part in the bus until it is restarted
    kStopped,  // the interface is down
  };

  State state = State::kUnknown;
  int tec = -1;                     // transmit error counter; -1: not told
  int rec = -1;                     // receive error counter; -1: not told
  std::int64_t bitrate = 0;         // bit/s that the interface runs at; 0: not told
  std::int64_t restart_ms = 0;      // after a bus-off it restarts by itself after so long; 0: it does not
  std::int64_t bus_offs = 0;        // error frames that told of one
  std::int64_t restarts = 0;        // after a bus-off
  std::int64_t bus_errors = 0;      // error frames of the protocol: bit, stuff, form, CRC
  std::int64_t unacknowledged = 0;  // own frames that no node acknowledged
  std::int64_t overruns = 0;        // frames that the controller itself lost
  std::int64_t queue_full = 0;      // own frames that the interface's queue or the controller did not take
  std::int64_t pending = 0;         // own frames sent and not yet acknowledged; the controller repeats them
  std::int64_t dropped = 0;         // received, and lost because the socket's buffer was full
};

}  // namespace axlecast
