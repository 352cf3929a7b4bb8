#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_reader.h"
#include "tools/log/opened_log.h"

namespace axlecast {

// Parses a time in a log and returns it in us, UNIX time. Returns nothing if the text has none of these forms:
// - "12.5", "12.5s", "15m", "2h" or "1d" after the first message
// - "-10" or "-15m" before the last message
// - "2026-11-21T07:00:05.25" (UTC, as ParseUtc, with any fraction of a second)
[[nodiscard]] std::optional<std::int64_t> ParseLogTime(std::string_view text, const LogSpan& span);

// The options --from and --until.
struct LogTimeOptions {
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Parses the options. The logs define the start and the end for relative times.
  [[nodiscard]] Result<> Parse(const std::vector<Bytes>& logs);

  // us, UNIX time, or nothing if the option was not given.
  std::optional<std::int64_t> from;
  std::optional<std::int64_t> until;

 private:
  std::string from_text_;
  std::string until_text_;
};

// The options --channel, --invert, --from and --until, which select the events of a log.
class LogFilter {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Parses the options for this log.
  [[nodiscard]] Result<> Parse(Bytes log);

  [[nodiscard]] bool Matches(const LogEvent& event) { return MatchesTime(event) && filter_.Matches(event.channel); }
  [[nodiscard]] bool MatchesTime(const LogEvent& event) const {  // for any channel
    return (!time_.from || event.utime >= *time_.from) && (!time_.until || event.utime < *time_.until);
  }
  // Returns an offset before which no event matches. Times may run back by at most kSeekSlackUs.
  [[nodiscard]] std::size_t Begin(Bytes log) const {
    return time_.from ? SeekTime(log, *time_.from - kSeekSlackUs) : 0;
  }
  // Returns true if no later event of the log matches.
  [[nodiscard]] bool EndsAt(const LogEvent& event) const {
    return time_.until && event.utime > *time_.until + kSeekSlackUs;
  }

 private:
  std::string channel_;
  bool invert_ = false;
  LogTimeOptions time_;
  ChannelFilter filter_;
};

// Shows the progress for a large log on standard error, if that is a terminal. `activity`: for example "reading"; "": show nothing.
class LogProgress {
 public:
  LogProgress(const char* activity, std::size_t bytes);
  ~LogProgress();
  LogProgress(const LogProgress&) = delete;
  LogProgress& operator=(const LogProgress&) = delete;

  void At(std::size_t position);

 private:
  const char* activity_;
  std::size_t bytes_;  // 0: show nothing
  std::size_t percent_ = 0;
};

// Opens a log, compressed or not. Shows the progress of the decompression of a large one.
[[nodiscard]] OpenedLog OpenLog(const std::string& path);

// A log that a command reads from its beginning to its end.
class LogInput {
 public:
  // Opens the log. If that fails, prints the error and returns false.
  [[nodiscard]] bool Open(const std::string& path);
  [[nodiscard]] const OpenedLog& file() const { return *file_; }
  [[nodiscard]] Bytes log() const { return file_->bytes(); }

  // Calls `visit` with each event from the offset `begin` on, and the event's offset, in order, until it returns false.
  // `activity`: see LogProgress.
  void Read(const char* activity, const std::function<bool(const LogEvent&, std::size_t offset)>& visit,
            std::size_t begin = 0);

  // Number of events and damage of the last Read.
  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] const std::vector<LogReader::Damage>& damage() const { return damage_; }
  // Returns kExitBad if the file is not a log, kExitLosses if a part of it is damaged or was lost meanwhile, else kExitDone. Prints
  // the error, except for damage.
  [[nodiscard]] int ExitCode() const;

 private:
  std::optional<OpenedLog> file_;
  std::int64_t events_ = 0;
  std::vector<LogReader::Damage> damage_;
};

// Logs that are read together.
class LogFiles {
 public:
  [[nodiscard]] Result<> Open(std::span<const std::string> paths);
  [[nodiscard]] const std::vector<OpenedLog>& files() const { return files_; }
  [[nodiscard]] const std::vector<Bytes>& bytes() const { return bytes_; }
  // Returns OpenedLog::Loss of the first log that has lost a part since it was opened, or an empty text.
  [[nodiscard]] std::string Loss() const;
  // Returns a line for each compressed log that is damaged (OpenedLog::damage).
  [[nodiscard]] std::string Damage() const;

 private:
  std::vector<OpenedLog> files_;
  std::vector<Bytes> bytes_;
};

// Returns a line for each of the first damaged regions, for example "run.log: 57 bytes from byte 1234 on are damaged", and the
// total if there are more.
[[nodiscard]] std::string DamageText(const std::string& file, const std::vector<LogReader::Damage>& damage);
[[nodiscard]] std::size_t DamagedBytes(const std::vector<LogReader::Damage>& damage);

// As LogInput::ExitCode, for a log in which `events` events were found.
[[nodiscard]] int LogExitCode(const OpenedLog& file, std::int64_t events,
                              const std::vector<LogReader::Damage>& damage);

inline constexpr const char* kLogExitCodes =
    "Exit code: 0 the log is complete, 3 a part of it is lost, 1 it is not a log or cannot be read, 2 usage,\n"
    "4 the output could not be written.";

// Returns the machine's file that the recorder has written at the beginning of the log. `file`: name of the log, for the error.
[[nodiscard]] Result<MachineConfig> MachineOf(Bytes log, const std::string& file);

}  // namespace axlecast
