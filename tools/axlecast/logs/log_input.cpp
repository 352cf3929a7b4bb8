#include "tools/axlecast/logs/log_input.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/utc_text.h"
#include "core/config/load.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

// Parses a number of seconds, or a number with the unit s, m, h or d. Returns us.
std::optional<std::int64_t> ParseDuration(std::string_view text) {
  if (text.empty() || text.find_first_of("wy") != std::string_view::npos) return std::nullopt;
  const bool has_unit = std::isalpha(static_cast<unsigned char>(text.back())) != 0;
  const std::optional<MonoNs> time = ParseTime(has_unit ? text : std::string(text) + 's');
  return time ? std::optional(*time / kMicrosecond) : std::nullopt;
}

// Returns us of a fraction like ".25" or ".25Z" at the end of the text. Sets `before` to the text before it.
std::optional<std::int64_t> TakeFraction(std::string_view text, std::string_view& before) {
  const std::size_t point = text.find('.');
  before = text.substr(0, point);
  if (point == std::string_view::npos) return 0;
  std::string_view digits = text.substr(point + 1);
  if (digits.ends_with('Z')) digits.remove_suffix(1);
  if (digits.empty() || digits.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  std::int64_t us = 0;
  for (std::size_t i = 0; i < 6; ++i) us = us * 10 + (i < digits.size() ? digits[i] - '0' : 0);
  return us;
}

constexpr std::size_t kLarge = 200'000'000;  // bytes; a smaller log needs no progress
constexpr std::size_t kDamageShown = 10;

}  // namespace

std::optional<std::int64_t> ParseLogTime(std::string_view text, const LogSpan& span) {
  if (text.starts_with('-')) {
    const auto before = ParseDuration(text.substr(1));
    return before ? std::optional(span.last - *before) : std::nullopt;
  }
  if (const auto since = ParseDuration(text)) return span.first + *since;
  std::string_view whole;
  const auto fraction = TakeFraction(text, whole);
  if (!fraction || whole.find('-') == std::string_view::npos) return std::nullopt;
  const auto seconds = ParseUtc(whole, 0);
  return seconds ? std::optional(*seconds + *fraction) : std::nullopt;
}

void LogTimeOptions::AddTo(CLI::App& command) {
  command
      .add_option("--from", from_text_,
                  "Begin at T: 12.5 (s), 15m or 2h after the start; -10 before the end; 2026-11-21T07:00 (UTC)")
      ->type_name("T");
  command.add_option("--until", until_text_, "End before T")->type_name("T");
}

Result<> LogTimeOptions::Parse(const std::vector<Bytes>& logs) {
  if (from_text_.empty() && until_text_.empty()) return {};
  const LogSpan span = SpanOf(logs);
  for (const auto& [text, time] : {std::pair(&from_text_, &from), {&until_text_, &until}}) {
    if (text->empty()) continue;
    *time = ParseLogTime(*text, span);
    if (!*time) {
      return Failure(
          "'" + *text +
          "' is not a time: write 12.5, 90s, 15m or 2h (after the first message), -10 (before the last one) "
          "or 2026-11-21T07:00:05.25 (UTC)");
    }
  }
  if (from && until && *from >= *until) return Failure("--from is not before --until: no event is between them");
  return {};
}

void LogFilter::AddTo(CLI::App& command) {
  command.add_option("--channel", channel_, "Select only channels that match REGEX")->type_name("REGEX");
  command.add_flag("--invert", invert_, "Select only channels that do not match");
  time_.AddTo(command);
}

Result<> LogFilter::Parse(Bytes log) {
  if (const Result<> set = filter_.Set(channel_, invert_); !set) return Failure("--channel: " + set.error().text);
  return time_.Parse({log});
}

LogProgress::LogProgress(const char* activity, std::size_t bytes)
    : activity_(activity), bytes_(*activity != 0 && bytes >= kLarge && isatty(STDERR_FILENO) == 1 ? bytes : 0) {}

LogProgress::~LogProgress() {
  if (percent_ > 0) static_cast<void>(std::fputs("\r\x1b[K", stderr));
}

void LogProgress::At(std::size_t position) {
  if (bytes_ == 0 || position / (bytes_ / 100) <= percent_) return;
  percent_ = position / (bytes_ / 100);
  static_cast<void>(std::fprintf(stderr, "\r%s: %zu %%\x1b[K", activity_, std::min<std::size_t>(percent_, 100)));
}

OpenedLog OpenLog(const std::string& path) {
  std::optional<LogProgress> shown;
  return OpenedLog(path, [&shown](std::size_t done, std::size_t total) {
    if (!shown) shown.emplace("decompressing", total);
    shown->At(done);
  });
}

bool LogInput::Open(const std::string& path) {
  file_.emplace(OpenLog(path));
  if (!file_->problem().empty()) std::cerr << file_->problem() << '\n';
  return file_->problem().empty();
}

void LogInput::Read(const char* activity, const std::function<bool(const LogEvent&, std::size_t offset)>& visit,
                    std::size_t begin) {
  LogProgress progress(activity, log().size());
  LogReader reader(log(), begin);
  events_ = 0;
  for (auto event = reader.Next(); event; event = reader.Next()) {
    ++events_;
    if (!visit(*event, reader.offset())) break;
    progress.At(reader.position());
  }
  damage_ = reader.damage();
}

int LogInput::ExitCode() const { return LogExitCode(*file_, events_, damage_); }

Result<> LogFiles::Open(std::span<const std::string> paths) {
  for (const std::string& path : paths) {
    const OpenedLog& file = files_.emplace_back(OpenLog(path));
    if (!file.problem().empty()) return Failure(file.problem());
    bytes_.push_back(file.bytes());
  }
  return {};
}

std::string LogFiles::Damage() const {
  std::string text;
  for (const OpenedLog& file : files_) {
    if (!file.damage().empty()) text += file.damage() + '\n';
  }
  return text;
}

std::string LogFiles::Loss() const {
  std::string loss;
  for (auto file = files_.begin(); file != files_.end() && loss.empty(); ++file) loss = file->Loss();
  return loss;
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

int LogExitCode(const OpenedLog& file, std::int64_t events, const std::vector<LogReader::Damage>& damage) {
  const std::string loss = file.Loss();
  if (!loss.empty()) std::cerr << loss << '\n';
  if (!file.damage().empty()) std::cerr << file.damage() << '\n';
  if (events == 0 && !file.bytes().empty()) {
    std::cerr << file.path() << " contains no event of LCM's log format: is it a log?\n";
    return kExitBad;
  }
  return loss.empty() && file.damage().empty() && damage.empty() ? kExitDone : kExitLosses;
}

Result<MachineConfig> MachineOf(Bytes log, const std::string& file) {
  constexpr int kHeaderEvents = 100;
  LogReader reader(log);
  for (int i = 0; i < kHeaderEvents; ++i) {
    const auto event = reader.Next();
    if (!event) break;
    if (event->channel != kMachineChannel) continue;
    ConfigErrors errors(file + ": " + std::string(kMachineChannel));
    auto machine = ParseConfig(std::string(event->data.begin(), event->data.end()), errors);
    if (!machine) return Failure(errors.Text());
    return std::move(*machine);
  }
  return Failure(file +
                 " does not contain the machine's file, as logs of `axlecast record` do: give it by --config\n");
}

}  // namespace axlecast
