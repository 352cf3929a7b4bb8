#pragma once

#include <cstdint>
#include <vector>

#include "tools/log/log_event.h"

namespace axlecast {

// us, 36,000 years. Times that damage made are bounded to this, so that sums and differences of them stay in range.
inline constexpr std::int64_t kFarthestUtime = INT64_MAX / 8;

// When the first and the last message of a log, or of several, were received: us, UNIX time; 0 without any.
struct LogSpan {
  std::int64_t first = 0;
  std::int64_t last = 0;
};

// Reads a few events at both ends. What a log holds of itself (IsLogChannel) does not count as its first message.
[[nodiscard]] LogSpan SpanOf(const std::vector<Bytes>& logs);

}  // namespace axlecast
