// Any text as shipped.json and as a line of holes.jsonl: what is read is written back equal, and within its ranges.
#include <cstdlib>

#include "tools/log/log_event.h"
#include "tools/log/log_holes.h"
#include "tools/log/log_name.h"
#include "tools/log/shipped_logs.h"

namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = axlecast::AsText({data, size});
  if (const auto shipped = axlecast::ParseShippedLogs(text)) {
    const auto again = axlecast::ParseShippedLogs(axlecast::FormatShippedLogs(*shipped));
    Require(again && again->logs == shipped->logs && again->utime == shipped->utime);
  }
  if (const auto hole = axlecast::ParseHole(text)) {
    Require(hole->logs > 0 && hole->bytes >= 0 && hole->file.find('/') == std::string::npos);
    const std::string line = axlecast::FormatHole(*hole);
    Require(line.ends_with('\n') && line.find('\n') == line.size() - 1);
    Require(axlecast::ParseHole(line.substr(0, line.size() - 1)) == hole);
  }
  const std::string_view prefix = axlecast::LogFilePrefix(text);
  Require(prefix.empty() || axlecast::LogFileBegin(prefix, text).has_value());
  return 0;
}
