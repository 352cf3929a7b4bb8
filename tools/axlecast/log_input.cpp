#include "tools/axlecast/log_input.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/log_time.h"

namespace axlecast {
namespace {

constexpr std::size_t kLarge = 200'000'000;  // bytes; a smaller log is read before anybody asks
constexpr std::size_t kDamageShown = 10;

}  // namespace

LogProgress::LogProgress(const char* doing, std::size_t bytes)
    : doing_(doing), bytes_(bytes >= kLarge && isatty(STDERR_FILENO) == 1 ? bytes : 0) {}

LogProgress::~LogProgress() {
  if (percent_ > 0) static_cast<void>(std::fputs("\r\x1b[K", stderr));
}

void LogProgress::At(std::size_t position) {
  if (bytes_ == 0 || position / (bytes_ / 100) <= percent_) return;
  percent_ = position / (bytes_ / 100);
  static_cast<void>(std::fprintf(stderr, "\r%s: %zu %%\x1b[K", doing_, std::min<std::size_t>(percent_, 100)));
}

void LogChoice::AddTo(CLI::App& command) {
  command.add_option("--channel", channel_, "Only channels in whose name this regular expression is found")
      ->type_name("REGEX");
  command.add_flag("--invert", invert_, "Only the other channels");
  command.add_option("--from", from_text_, "From then on: seconds from the start (12.5), 15m, 2h, or UTC")
      ->type_name("T");
  command.add_option("--to", to_text_, "Before then")->type_name("T");
}

std::string LogChoice::Understand(std::int64_t start) {
  if (std::string problem = filter_.Set(channel_, invert_); !problem.empty()) return "--channel " + problem;
  for (const auto& [text, time] : {std::pair(&from_text_, &from_), {&to_text_, &to_}}) {
    if (text->empty()) continue;
    const auto parsed = ParseLogTime(*text, start);
    if (!parsed) return "'" + *text + "' is no time: " + kLogTimeForms;
    *time = *parsed;
  }
  return from_ < to_ ? "" : "--from is not before --to: nothing stands between";
}

bool LogChoice::Takes(const LogEvent& event) {
  return event.utime >= from_ && event.utime < to_ && filter_.Takes(event.channel);
}

std::int64_t LogStart(Bytes log) {
  const auto first = LogReader(log).Next();
  return first ? first->utime : 0;
}

std::string DamageText(const std::string& file, const std::vector<LogReader::Damage>& damage) {
  std::string text;
  for (const LogReader::Damage& piece : damage) {
    if (&piece - damage.data() == kDamageShown) {
      text += file + ": ... " + std::to_string(damage.size()) + " damaged places, " +
              std::to_string(DamagedBytes(damage)) + " bytes in all\n";
      break;
    }
    text += file + ": " + std::to_string(piece.size) + " bytes from byte " + std::to_string(piece.offset) +
            " on are damaged\n";
  }
  return text;
}

std::size_t DamagedBytes(const std::vector<LogReader::Damage>& damage) {
  std::size_t bytes = 0;
  for (const LogReader::Damage& piece : damage) bytes += piece.size;
  return bytes;
}

int LogExitCode(const std::string& file, Bytes log, std::int64_t events,
                const std::vector<LogReader::Damage>& damage) {
  if (events == 0 && !log.empty()) {
    std::cerr << file << " holds no event of LCM's log format: is it a log?\n";
    return kExitBad;
  }
  return damage.empty() ? kExitDone : kExitLosses;
}

}  // namespace axlecast
