#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/inline_bytes.h"

namespace axlecast {

// A message on its way into a log.
struct LoggedMessage {
  std::int64_t utime = 0;  // us, UNIX time of its reception
  std::string_view channel;
  Bytes data;
};

}  // namespace axlecast
