#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>

#include "tools/axlecast/logs/log_time.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_event.h"

namespace axlecast {

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

}  // namespace axlecast
