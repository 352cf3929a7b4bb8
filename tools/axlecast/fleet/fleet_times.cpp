#include "tools/axlecast/fleet/fleet_times.h"

#include <algorithm>

#include "core/base/spelling.h"
#include "tools/axlecast/logs/log_input.h"

namespace axlecast {
namespace {

// Returns the times of the machine's first and last message in the database.
Result<LogSpan> SpanOf(FleetReader& reader, const FleetMachine& machine) {
  const auto logs = reader.Logs(machine);
  if (!logs) return Failure(logs.error());
  LogSpan span;
  for (const FleetLog& log : *logs) {
    if (log.first_utime != 0)
      span.first = span.first == 0 ? log.first_utime : std::min(span.first, log.first_utime);
    span.last = std::max(span.last, log.last_utime);
  }
  return span;
}

}  // namespace

void FleetTimeOptions::AddTo(CLI::App& command) {
  command
      .add_option("--from", from_,
                  "Begin at T: 2026-11-21T07:00 (UTC); -10 (s), -15m or -2h before the machine's last message; 1d "
                  "after its "
                  "first one")
      ->type_name("T");
  command.add_option("--until", until_, "End before T")->type_name("T");
}

Result<QueryTimes> FleetTimeOptions::Parse(FleetReader& reader, const FleetMachine& machine) const {
  QueryTimes times;
  if (from_.empty() && until_.empty()) return times;
  const auto span = SpanOf(reader, machine);
  if (!span) return Failure(span.error());
  for (const auto& [text, time] : {std::pair(&from_, &times.from), {&until_, &times.until}}) {
    if (text->empty()) continue;
    *time = ParseLogTime(*text, *span);
    if (!*time) {
      return Failure(Quoted(*text) +
                     " is not a time: write 2026-11-21T07:00:05.25 (UTC), -10, -15m or -2h (before the last "
                     "message), or 90s, 15m, "
                     "2h (after the first one)");
    }
  }
  if (times.from && times.until && *times.from >= *times.until) {
    return Failure("--from is not before --until: no row is between them");
  }
  return times;
}

}  // namespace axlecast
