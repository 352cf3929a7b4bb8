#include "tools/log/log_span.h"

#include <algorithm>
#include <optional>

#include "tools/log/log_header.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

constexpr std::size_t kTail = 64U << 10;  // bytes: where a log's last event is looked for at first

std::optional<std::int64_t> LastUtimeOf(Bytes log) {
  for (std::size_t tail = kTail;; tail *= 4) {
    LogReader reader(log, log.size() - std::min(tail, log.size()));
    std::optional<std::int64_t> last;
    while (const std::optional<LogEvent> event = reader.Next()) {
      last = std::clamp(event->utime, -kFarthestUtime, kFarthestUtime);
    }
    if (last || tail >= log.size()) return last;
  }
}

}  // namespace

LogSpan SpanOf(const std::vector<Bytes>& logs) {
  LogMerge merge(logs);
  std::optional<std::int64_t> last;
  for (const Bytes log : logs) last = std::max(last, LastUtimeOf(log));  // nothing is before everything
  return {.first = merge.SkipBookkeeping().value_or(0), .last = last.value_or(0)};
}

}  // namespace axlecast
