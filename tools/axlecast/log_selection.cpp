#include "tools/axlecast/log_selection.h"

#include <iostream>
#include <utility>

#include "drivers/io/system_clock.h"
#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/utc_text.h"
#include "tools/log/log_reader.h"

namespace axlecast {

void LogSelection::AddTo(CLI::App& command) {
  command.add_option("LOG", file_, "An LCM event log, of axlecast record or lcm-logger")->required();
  command.add_option("--channel", channel_, "Only channels in whose name this regular expression is found")
      ->type_name("REGEX");
  command.add_flag("--invert", invert_, "Only the other channels");
  command.add_option("--since", since_, "Only what was received from then on: 2h (ago), 2026-11-21T07:00:05 (UTC)")
      ->type_name("T");
  command.add_option("--until", until_, "Only what was received before")->type_name("T");
}

std::optional<int> LogSelection::Open() {
  if (const std::string problem = filter_.Set(channel_, invert_); !problem.empty()) {
    std::cerr << "--channel " << problem << '\n';
    return kExitUsage;
  }
  const std::int64_t now = SystemClock().UtcMicroseconds();
  since_utime_ = ParseUtc(since_, now);
  until_utime_ = ParseUtc(until_, now);
  for (const auto& [text, time] : {std::pair(since_, since_utime_), {until_, until_utime_}}) {
    if (text.empty() || time) continue;
    std::cerr << "'" << text
              << "' is no time: write 90s, 15m, 2h, 3d (ago), 2026-11-21 or 2026-11-21T07:00:05 (UTC)\n";
    return kExitUsage;
  }
  log_ = std::make_unique<MappedFile>(file_);
  if (!log_->problem().empty()) {
    std::cerr << log_->problem() << '\n';
    return kExitBad;
  }
  if (log_->bytes().empty() || LogReader(log_->bytes()).Next()) return std::nullopt;
  std::cerr << file_ << " holds no event of LCM's log format: is it a log?\n";
  return kExitBad;
}

void LogSelection::Visit(const EventVisitor& visit, bool filtered) {
  const std::size_t begin = since_utime_ ? SeekTime(log_->bytes(), *since_utime_) : 0;
  LogReader reader(log_->bytes(), begin);
  while (const std::optional<LogEvent> event = reader.Next()) {
    if (since_utime_ && event->utime < *since_utime_) continue;
    // Times run back a little, never much.
    if (until_utime_ && event->utime > *until_utime_ + kSeekSlackUs) break;
    if (until_utime_ && event->utime >= *until_utime_) continue;
    if (filtered && !filter_.Takes(event->channel)) continue;
    if (!visit(*event)) return;
  }
  damaged_bytes_ = 0;
  for (const LogReader::Damage& damage : reader.damage()) damaged_bytes_ += damage.size;
}

EventRange LogSelection::events() {
  return [this](const EventVisitor& visit) { Visit(visit, true); };
}

EventRange LogSelection::all() {
  return [this](const EventVisitor& visit) { Visit(visit, false); };
}

}  // namespace axlecast
