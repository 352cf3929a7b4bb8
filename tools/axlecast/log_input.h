#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/io/mapped_file.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// How far the reading of a large log is: on standard error, when that is a terminal.
class LogProgress {
 public:
  LogProgress(const char* doing, std::size_t bytes);
  ~LogProgress();
  LogProgress(const LogProgress&) = delete;
  LogProgress& operator=(const LogProgress&) = delete;

  void At(std::size_t position);

 private:
  const char* doing_;
  std::size_t bytes_;  // 0: shows nothing
  std::size_t percent_ = 0;
};

// Which events of a log a command takes: --channel, --invert, --from, --to.
class LogChoice {
 public:
  void AddTo(CLI::App& command);

  // Empty, or what is wrong with the options; `start`: us, UNIX time, of the log's first event.
  [[nodiscard]] std::string Understand(std::int64_t start);
  [[nodiscard]] bool Takes(const LogEvent& event);

 private:
  std::string channel_;
  bool invert_ = false;
  std::string from_text_;
  std::string to_text_;
  ChannelFilter filter_;
  std::int64_t from_ = INT64_MIN;
  std::int64_t to_ = INT64_MAX;
};

// us, UNIX time, of the log's first event; 0 where there is none.
[[nodiscard]] std::int64_t LogStart(Bytes log);

// "damage: 57 bytes at byte 1234 are no event" for each of the first ones, and how many there are.
[[nodiscard]] std::string DamageText(const std::string& file, const std::vector<LogReader::Damage>& damage);
[[nodiscard]] std::size_t DamagedBytes(const std::vector<LogReader::Damage>& damage);

// What a command that has read the log to its end exits with: kExitBad with a word on standard error where it is none.
[[nodiscard]] int LogExitCode(const std::string& file, Bytes log, std::int64_t events,
                              const std::vector<LogReader::Damage>& damage);

inline constexpr const char* kLogExitCodes =
    "Exit code: 0 the log is whole, 3 it can be read but something is lost, 1 it is no log or cannot be read, 2 "
    "usage,\n4 the output could not be written.";

}  // namespace axlecast
