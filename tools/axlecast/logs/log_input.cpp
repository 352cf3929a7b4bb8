#include "tools/axlecast/logs/log_input.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

constexpr std::size_t kLarge = 200'000'000;  // bytes; a smaller log is read before anybody asks
constexpr std::size_t kDamageShown = 10;

}  // namespace

LogProgress::LogProgress(const char* doing, std::size_t bytes)
    : doing_(doing), bytes_(*doing != 0 && bytes >= kLarge && isatty(STDERR_FILENO) == 1 ? bytes : 0) {}

LogProgress::~LogProgress() {
  if (percent_ > 0) static_cast<void>(std::fputs("\r\x1b[K", stderr));
}

void LogProgress::At(std::size_t position) {
  if (bytes_ == 0 || position / (bytes_ / 100) <= percent_) return;
  percent_ = position / (bytes_ / 100);
  static_cast<void>(std::fprintf(stderr, "\r%s: %zu %%\x1b[K", doing_, std::min<std::size_t>(percent_, 100)));
}

bool LogInput::Open(const std::string& path) {
  file_.emplace(path);
  if (!file_->problem().empty()) std::cerr << file_->problem() << '\n';
  return file_->problem().empty();
}

void LogInput::Read(const char* doing, const std::function<bool(const LogEvent&, std::size_t offset)>& visit) {
  LogProgress progress(doing, log().size());
  LogReader reader(log());
  events_ = 0;
  for (auto event = reader.Next(); event; event = reader.Next()) {
    ++events_;
    if (!visit(*event, reader.offset())) break;
    progress.At(reader.position());
  }
  damage_ = reader.damage();
}

int LogInput::ExitCode() const { return LogExitCode(*file_, events_, damage_); }

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

int LogExitCode(const MappedFile& file, std::int64_t events, const std::vector<LogReader::Damage>& damage) {
  const std::string loss = file.Loss();
  if (!loss.empty()) std::cerr << loss << '\n';
  if (events == 0 && !file.bytes().empty()) {
    std::cerr << file.path() << " holds no event of LCM's log format: is it a log?\n";
    return kExitBad;
  }
  return loss.empty() && damage.empty() ? kExitDone : kExitLosses;
}

}  // namespace axlecast
