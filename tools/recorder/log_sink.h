#pragma once

#include <cstdint>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Where the logs of a recording go, one after the other.
class LogSink {
 public:
  virtual ~LogSink() = default;
  virtual void Begin(std::int64_t utime) = 0;  // a log begins; us, UNIX time
  virtual void Write(Bytes record) = 0;        // one whole record
  virtual void End() = 0;                      // the log is complete
};

}  // namespace axlecast
