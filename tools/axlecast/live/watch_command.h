#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/sequence_count.h"
#include "tools/axlecast/common/on_base.h"

namespace axlecast {

// Formats messages as lines, and counts lost messages. Messages on channels beyond kMaxChannels are shown but not counted:
// any host can invent channels.
class MessageWatch {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;

  // Selects the channels whose name matches `channel`.
  MessageWatch(std::regex channel, bool json) : channel_(std::move(channel)), json_(json) {}

  // Returns the line of one message with its newline, or nothing if its channel is not selected or its type is unknown.
  // `now`: CLOCK_MONOTONIC.
  [[nodiscard]] std::optional<std::string> On(const std::string& channel, Bytes message, MonoNs now = 0);

  [[nodiscard]] std::int64_t shown() const { return shown_; }
  [[nodiscard]] std::size_t channels() const { return channels_.size(); }

  // Returns the names of channels that were received but not selected.
  [[nodiscard]] std::string OtherChannels() const;

  // Returns a table of the channels: the rate since the last call, and the newest message.
  [[nodiscard]] std::vector<std::string> Table(MonoNs now);

  // Returns one line for each channel with losses, and for messages that were not counted or not shown.
  [[nodiscard]] std::vector<std::string> Losses() const;

 private:
  struct Seen {
    SequenceCount sequence;
    std::string newest;
    std::int64_t at_window = 0;  // received when the window of the rate began
    double hz = 0;
  };

  void Count(const std::string& channel, std::int64_t boot_id, std::int64_t seq, const std::string& newest);

  std::regex channel_;
  bool json_;
  std::map<std::string, Seen> channels_;
  std::set<std::string> others_;  // the first ones only
  std::int64_t shown_ = 0;
  std::int64_t unknown_ = 0;
  std::int64_t uncounted_ = 0;  // messages of further channels
  OnBase base_;
  MonoNs window_ = 0;
};

}  // namespace axlecast
