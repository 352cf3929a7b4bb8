#pragma once

#include <regex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/base/inline_bytes.h"
#include "tools/log/channel_filter.h"

namespace axlecast {

// Where a message on a channel of this name would be taken for a command, a permit, or the dialogue about one.
enum class CommandChannel {
  kNone,
  kBehindPrefix,  // by a machine with a prefix that the name begins with: if the message is of such a type
  kPlain,         // the channel's own name
};
[[nodiscard]] CommandChannel JudgeCommandChannel(std::string_view channel);

// Whether the message is of a type that commands, permits and their answers are made of.
[[nodiscard]] bool IsCommandMessage(Bytes message);

// Which of a log's channels are played, and under which name.
class ReplayChannels {
 public:
  // What becomes of a channel.
  struct Fate {
    bool selected = false;
    std::string name;                                // under which it is published
    CommandChannel command = CommandChannel::kNone;  // of that name
  };

  // The default plays every channel under its own name. Select and Rename return an empty string, or what is
  // wrong.

  // Plays only channels in whose name the expression (ECMAScript) is found; inverted, only the others.
  [[nodiscard]] std::string Select(const std::string& expression, bool invert) {
    return filter_.Set(expression, invert);
  }
  // "OLD=NEW": where OLD (ECMAScript) is found in a name, NEW stands in its place; $1, $& as in ECMAScript. The first
  // '=' divides them. Several are applied one after the other.
  [[nodiscard]] std::string Rename(const std::string& rule);
  // Put before each name, behind all renaming.
  void Prefix(std::string prefix) { prefix_ = std::move(prefix); }

  // The same object for the same channel, for as long as this one lives.
  [[nodiscard]] const Fate& Of(std::string_view channel);

 private:
  [[nodiscard]] Fate Decide(const std::string& channel);

  ChannelFilter filter_;
  std::vector<std::pair<std::regex, std::string>> renames_;
  std::string prefix_;

  struct Hash : std::hash<std::string_view> {
    using is_transparent = void;
  };
  std::unordered_map<std::string, Fate, Hash, std::equal_to<>> fates_;
};

}  // namespace axlecast
