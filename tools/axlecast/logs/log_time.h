#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/log/log_merge.h"

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

}  // namespace axlecast
