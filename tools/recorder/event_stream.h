#pragma once

#include <cstdint>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"
#include "tools/log/log_tail.h"
#include "tools/recorder/logged_message.h"

namespace axlecast {

// The records of one log: numbers its events and seals them.
class EventStream {
 public:
  // What stands in a log that is continued.
  struct Begin {
    std::int64_t events = 0;  // all, also seals: the next one's number
    std::uint64_t bytes = 0;
    LogSeal unsealed;
  };

  // Behind what a log holds.
  [[nodiscard]] static Begin After(const LogTail& tail) { return {tail.next_number, tail.size, tail.open.seal()}; }

  EventStream() = default;
  explicit EventStream(const Begin& begin) : begin_(begin) {}

  // The event's record, until the next call.
  [[nodiscard]] Bytes Add(const LoggedMessage& message);
  // A seal over what was added since the one before; no bytes where nothing was.
  [[nodiscard]] Bytes Seal(std::int64_t utime);

  [[nodiscard]] std::uint64_t bytes() const { return begin_.bytes; }

 private:
  void Write(const LoggedMessage& message);

  Begin begin_;
  std::vector<std::uint8_t> record_;
};

}  // namespace axlecast
