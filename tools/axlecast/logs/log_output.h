#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "platform/os/new_file.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"

namespace axlecast {

// Writes a log that is numbered from 0 and sealed like those of the recorder. The file appears at its path when it is complete.
class LogOutput {
 public:
  LogOutput(std::string path, mode_t mode);

  // Adds the event with the next number. Ignores seals, and header events that were already added.
  void Add(const LogEvent& event);
  // Writes the rest, and moves the file to its path.
  [[nodiscard]] Result<> Commit(bool replace);

  [[nodiscard]] std::int64_t events() const { return events_; }   // without seals
  [[nodiscard]] bool good() const { return state_.has_value(); }  // no write has failed so far

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
  std::int64_t sealed_ = 0;  // time of the last seal, or of the first event
  Result<> state_;           // the first error of a write
};

}  // namespace axlecast
