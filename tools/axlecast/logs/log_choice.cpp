#include "tools/axlecast/logs/log_choice.h"

#include "tools/log/log_reader.h"

namespace axlecast {

void LogChoice::AddTo(CLI::App& command) {
  command.add_option("--channel", channel_, "Only channels in whose name this regular expression is found")
      ->type_name("REGEX");
  command.add_flag("--invert", invert_, "Only the other channels");
  time_.AddTo(command);
}

std::string LogChoice::Understand(Bytes log) {
  if (std::string problem = filter_.Set(channel_, invert_); !problem.empty()) return "--channel " + problem;
  return time_.Understand({log});
}

bool LogChoice::TakesTime(const LogEvent& event) const {
  return (!time_.from() || event.utime >= *time_.from()) && (!time_.until() || event.utime < *time_.until());
}

// Times run back a little, never much.
std::size_t LogChoice::Begin(Bytes log) const {
  return time_.from() ? SeekTime(log, *time_.from() - kSeekSlackUs) : 0;
}

bool LogChoice::EndsAt(const LogEvent& event) const {
  return time_.until() && event.utime > *time_.until() + kSeekSlackUs;
}

}  // namespace axlecast
