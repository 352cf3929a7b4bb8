#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "platform/os/new_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"

namespace axlecast {

// A log that a command writes: numbered from 0 and sealed as our recorder's are. It stands at its place once it is
// whole.
class LogOutput {
 public:
  LogOutput(std::string path, mode_t mode);

  // The event under the next number. Seals are left out: it has its own. A header that it already has is left out too.
  void Add(const LogEvent& event);
  // Writes the rest, and puts it in its place. Empty, or why this failed.
  [[nodiscard]] std::string Commit(bool replace);

  [[nodiscard]] std::int64_t events() const { return events_; }          // without seals
  [[nodiscard]] const std::string& problem() const { return problem_; }  // of writing so far

 private:
  void Write(const LogEvent& event);
  void Seal();
  void Flush();

  NewFile file_;
  std::vector<std::uint8_t> buffer_;
  std::set<std::pair<std::string, std::vector<std::uint8_t>>> headers_;
  SealCount count_;
  std::int64_t number_ = 0;
  std::int64_t events_ = 0;
  std::int64_t utime_ = 0;   // of the last event
  std::int64_t sealed_ = 0;  // us, UNIX time, of the last seal, or the first event
  std::string problem_;
};

}  // namespace axlecast
