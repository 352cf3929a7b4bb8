#pragma once

#include <regex>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/base/inline_bytes.h"
#include "tools/log/channel_filter.h"

namespace axlecast {

// Whether a receiver accepts a message on a channel of this name as a command, as a permit, or as an answer to one.
enum class CommandChannel {
  kNone,
  kAfterPrefix,  // only a machine whose prefix is the beginning of the name: depends on the type of the message
  kPlain,        // every machine without a prefix
};
[[nodiscard]] CommandChannel CommandChannelOf(std::string_view channel);

// Returns true if the message is a command, a permit, or an answer to one.
[[nodiscard]] bool IsCommandMessage(Bytes message);

// Selects the channels of a log that are replayed, and renames them. By default, every channel is replayed under its own name.
class ReplayChannels {
 public:
  struct Target {
    bool selected = false;
    std::string name;                                // name under which the channel is published
    CommandChannel command = CommandChannel::kNone;  // of that name
  };

  // Selects the channels that match the expression (ECMAScript). With `invert`: those that do not match.
  [[nodiscard]] Result<> Select(const std::string& expression, bool invert) {
    return filter_.Set(expression, invert);
  }
  // Adds the rule "OLD=NEW": each match of OLD (ECMAScript) in a name is replaced by NEW, which may contain $1 and $&. The first
  // '=' separates OLD and NEW. Several rules are applied in the order in which they were added.
  [[nodiscard]] Result<> Rename(const std::string& rule);
  // Sets the prefix of each name. It is added after all renaming.
  void Prefix(std::string prefix) { prefix_ = std::move(prefix); }

  // Returns the target of the channel. The reference is valid as long as this object.
  [[nodiscard]] const Target& Of(std::string_view channel);

 private:
  [[nodiscard]] Target MakeTarget(const std::string& channel);

  ChannelFilter filter_;
  std::vector<std::pair<std::regex, std::string>> renames_;
  std::string prefix_;

  struct Hash : std::hash<std::string_view> {
    using is_transparent = void;
  };
  std::unordered_map<std::string, Target, Hash, std::equal_to<>> targets_;
};

}  // namespace axlecast
