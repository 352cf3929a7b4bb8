#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "platform/os/new_file.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Writes a log that is numbered from 0 and sealed like those of the recorder. The file appears at its path when it is complete.
class LogOutput {
 public:
  LogOutput(std::string path, mode_t mode) : file_(std::move(path), {.mode = mode}) {}

  // Adds the event with the next number. Ignores seals, and header events that were already added.
  void Add(const LogEvent& event) {
    if (event.channel == kSealChannel) return;
    if (IsLogChannel(event.channel) && !headers_.emplace(event.channel, AsText(event.data)).second) return;
    if (events_ == 0) sealed_ = event.utime;
    ++events_;
    utime_ = event.utime;
    good_ = file_.Collect(AsText(encoder_.Add(event)));
    const std::uint64_t since = static_cast<std::uint64_t>(utime_) - static_cast<std::uint64_t>(sealed_);
    if (since >= kSealUs || encoder_.unsealed_bytes() >= kSealBytes) Seal();
  }
  // Writes the rest, and moves the file to its path.
  [[nodiscard]] Result<> Commit(bool replace) {
    Seal();
    return file_.Commit(replace);
  }

  [[nodiscard]] std::int64_t events() const { return events_; }  // without seals
  [[nodiscard]] bool good() const { return good_; }              // no write has failed so far

 private:
  static constexpr std::int64_t kSealUs = 1'000'000;  // as the recorder does
  static constexpr std::uint64_t kSealBytes = 16U << 20;

  void Seal() {
    good_ = file_.Collect(AsText(encoder_.Seal(utime_)));
    sealed_ = utime_;
  }

  NewFile file_;
  std::set<std::pair<std::string, std::string>> headers_;  // channel and content
  LogEncoder encoder_;
  std::int64_t events_ = 0;
  std::int64_t utime_ = 0;   // of the last event
  std::int64_t sealed_ = 0;  // time of the last seal, or of the first event
  bool good_ = true;
};

}  // namespace axlecast
