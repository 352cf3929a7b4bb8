#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "platform/os/mapped_file.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"
#include "tools/log/log_reader.h"

namespace axlecast {

// us, UNIX time, of a place in a log, as people write it: "12.5" or "12.5s", "15m", "2h", "1d" from its first message;
// "-10", "-15m" before its last one; "2026-11-21T07:00:05.25" (UTC, as ParseUtc, with any part of a second). Nothing when
// it is none of these.
[[nodiscard]] std::optional<std::int64_t> ParseLogTime(std::string_view text, const LogSpan& span);

// --from and --until of every command that takes a part of logs.
class LogTimeOptions {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Empty, or what is wrong with them; the logs say from when they count.
  [[nodiscard]] std::string Understand(const std::vector<Bytes>& logs);

  // us, UNIX time; nothing where the option was not given.
  [[nodiscard]] const std::optional<std::int64_t>& from() const { return from_; }
  [[nodiscard]] const std::optional<std::int64_t>& until() const { return until_; }

 private:
  std::string from_text_;
  std::string until_text_;
  std::optional<std::int64_t> from_;
  std::optional<std::int64_t> until_;
};

// Which events of a log a command takes: --channel, --invert, --from, --until.
class LogChoice {
 public:
  // The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Empty, or what is wrong with the options.
  [[nodiscard]] std::string Understand(Bytes log);

  [[nodiscard]] bool Takes(const LogEvent& event) { return TakesTime(event) && filter_.Takes(event.channel); }
  [[nodiscard]] bool TakesTime(const LogEvent& event) const;  // whatever its channel
  // The offset before which no event is that it takes.
  [[nodiscard]] std::size_t Begin(Bytes log) const;
  // Whether no later event of its log is one that it takes.
  [[nodiscard]] bool EndsAt(const LogEvent& event) const;

 private:
  std::string channel_;
  bool invert_ = false;
  LogTimeOptions time_;
  ChannelFilter filter_;
};

// How far the reading of a large log is: on standard error, when that is a terminal. "": nowhere.
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

// The log that a command reads from its beginning to its end.
class LogInput {
 public:
  // False when it cannot be opened, which is said on standard error.
  [[nodiscard]] bool Open(const std::string& path);
  [[nodiscard]] const MappedFile& file() const { return *file_; }
  [[nodiscard]] Bytes log() const { return file_->bytes(); }

  // Shows all events in order, until `visit` says no; the offset is that of the event. `doing`: see LogProgress.
  void Read(const char* doing, const std::function<bool(const LogEvent&, std::size_t offset)>& visit);

  // Of what was read.
  [[nodiscard]] std::int64_t events() const { return events_; }
  [[nodiscard]] const std::vector<LogReader::Damage>& damage() const { return damage_; }
  // What the command exits with: kExitBad where it is no log, kExitLosses where something of it is damaged or gone. The
  // first, and what became of the file meanwhile, is said on standard error.
  [[nodiscard]] int ExitCode() const;

 private:
  std::optional<MappedFile> file_;
  std::int64_t events_ = 0;
  std::vector<LogReader::Damage> damage_;
};

// "run.log: 57 bytes from byte 1234 on are damaged" for each of the first ones, and how many there are.
[[nodiscard]] std::string DamageText(const std::string& file, const std::vector<LogReader::Damage>& damage);
[[nodiscard]] std::size_t DamagedBytes(const std::vector<LogReader::Damage>& damage);

// As LogInput::ExitCode, of a log in which so many events were found.
[[nodiscard]] int LogExitCode(const MappedFile& file, std::int64_t events,
                              const std::vector<LogReader::Damage>& damage);

inline constexpr const char* kLogExitCodes =
    "Exit code: 0 the log is whole, 3 it can be read but something is lost, 1 it is no log or cannot be read, 2 "
    "usage,\n4 the output could not be written.";

// The machine's file that a log begins with: a recorder writes it before all that it hears. Nothing where there is none
// or it cannot be used; `problem` then says why. `file`: the log's name, for that.
[[nodiscard]] std::optional<MachineConfig> MachineOf(Bytes log, const std::string& file, std::string& problem);

}  // namespace axlecast
