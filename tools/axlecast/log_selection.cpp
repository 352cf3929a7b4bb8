#include "tools/axlecast/log_selection.h"

#include <iostream>
#include <utility>

#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/log_input.h"
#include "tools/axlecast/log_time.h"
#include "tools/log/log_reader.h"

namespace axlecast {

void LogSelection::AddTo(CLI::App& command) {
  command.add_option("LOG", file_, "An LCM event log, of axlecast record or lcm-logger")->required();
  command.add_option("--channel", channel_, "Only channels in whose name this regular expression is found")
      ->type_name("REGEX");
  command.add_flag("--invert", invert_, "Only the other channels");
  command.add_option("--since,--from", since_, "From then on: seconds from the start (12.5), 15m, 2h, or UTC")
      ->type_name("T");
  command.add_option("--until", until_, "Before then")->type_name("T");
}

std::optional<int> LogSelection::Open() {
  if (const std::string problem = filter_.Set(channel_, invert_); !problem.empty()) {
    std::cerr << "--channel " << problem << '\n';
    return kExitUsage;
  }
  log_ = std::make_unique<MappedFile>(file_);
  if (!log_->problem().empty()) {
    std::cerr << log_->problem() << '\n';
    return kExitBad;
  }
  const bool any = LogReader(log_->bytes()).Next().has_value();
  if (LogExitCode(file_, log_->bytes(), any ? 1 : 0, {}) == kExitBad) return kExitBad;
  const std::int64_t start = LogStart(log_->bytes());
  since_utime_ = ParseLogTime(since_, start);
  until_utime_ = ParseLogTime(until_, start);
  for (const auto& [text, time] : {std::pair(since_, since_utime_), {until_, until_utime_}}) {
    if (text.empty() || time) continue;
    std::cerr << "'" << text << "' is no time: " << kLogTimeForms << '\n';
    return kExitUsage;
  }
  return std::nullopt;
}

void LogSelection::Visit(const EventVisitor& visit, bool filtered) {
  const std::size_t begin = since_utime_ ? SeekTime(log_->bytes(), *since_utime_ - kSeekSlackUs) : 0;
  LogReader reader(log_->bytes(), begin);
  while (const std::optional<LogEvent> event = reader.Next()) {
    if (since_utime_ && event->utime < *since_utime_) continue;
    // Times run back a little, never much.
    if (until_utime_ && event->utime > *until_utime_ + kSeekSlackUs) break;
    if (until_utime_ && event->utime >= *until_utime_) continue;
    if (filtered && !filter_.Takes(event->channel)) continue;
    if (!visit(*event)) return;
  }
  damaged_bytes_ = DamagedBytes(reader.damage());
}

EventRange LogSelection::events() {
  return [this](const EventVisitor& visit) { Visit(visit, true); };
}

EventRange LogSelection::all() {
  return [this](const EventVisitor& visit) { Visit(visit, false); };
}

}  // namespace axlecast
