#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/sequence_count.h"

namespace axlecast {

// Turns messages into lines, and counts what is missing between them. Pure. Anybody may invent channels: beyond
// kMaxChannels further ones are shown but not counted.
class MessageWatch {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;

  // Only channels in whose name `channel` is found.
  MessageWatch(std::regex channel, bool json) : channel_(std::move(channel)), json_(json) {}

  // The line of one message, with its newline; nothing when it is of another channel or none of ours.
  [[nodiscard]] std::optional<std::string> On(const std::string& channel, Bytes message);

  [[nodiscard]] std::int64_t shown() const { return shown_; }
  [[nodiscard]] std::size_t channels() const { return channels_.size(); }

  // Of messages that came on other channels only: their names, for a `channel` that finds none. Empty when none came.
  [[nodiscard]] std::string OtherChannels() const;

  // A table of the channels: rate since the last call, and the newest message of each.
  [[nodiscard]] std::vector<std::string> Table(MonoNs now);

  // What did not come or could not be shown, one line each.
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
  std::set<std::string> others_;  // as many as are worth naming
  std::int64_t shown_ = 0;
  std::int64_t foreign_ = 0;
  std::int64_t uncounted_ = 0;  // messages of further channels
  MonoNs window_ = 0;
};

// What matters of a message (of `type`, as DecodeToJson gives it), for a person, in printable ASCII.
[[nodiscard]] std::string Describe(const std::string& type, const nlohmann::ordered_json& message);

}  // namespace axlecast
