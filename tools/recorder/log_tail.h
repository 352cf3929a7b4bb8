#pragma once

#include <cstddef>

#include "tools/recorder/event_stream.h"

namespace axlecast {

// How a log that is to be continued ends.
struct LogTail {
  EventStream::Begin begin;  // up to the last whole event
  std::size_t torn = 0;      // bytes behind it that are no whole event
  std::size_t damaged = 0;   // bytes before it that are none; they stay
};

// Reads all of `log`.
[[nodiscard]] LogTail FindTail(Bytes log);

}  // namespace axlecast
