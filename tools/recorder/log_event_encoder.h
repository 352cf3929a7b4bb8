#pragma once

#include <cstdint>
#include <vector>

#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"
#include "tools/log/log_tail.h"
#include "tools/recorder/logged_message.h"

namespace axlecast {

// The records of one log: numbers its events and seals them.
class LogEventEncoder {
 public:
  LogEventEncoder() = default;
  // Goes on with a log that ends so.
  explicit LogEventEncoder(const LogTail& tail) : number_(tail.next_number), bytes_(tail.size), open_(tail.open) {}

  // The event's record, until the next call.
  [[nodiscard]] Bytes Add(const LoggedMessage& message);
  // A seal over what was added since the one before; no bytes where nothing was.
  [[nodiscard]] Bytes Seal(std::int64_t utime);

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void Write(const LoggedMessage& message);

  std::int64_t number_ = 0;  // of the next event
  std::uint64_t bytes_ = 0;
  SealCount open_;
  std::vector<std::uint8_t> record_;
};

}  // namespace axlecast
