#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "platform/os/mapped_file.h"
#include "tools/log/log_reader.h"

namespace axlecast {

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

}  // namespace axlecast
