#pragma once

#include <regex>
#include <string>
#include <string_view>
#include <unordered_map>

namespace axlecast {

// Which channels are wanted: those in whose name the expression is found, or with `invert` the others.
class ChannelFilter {
 public:
  ChannelFilter(std::regex channel, bool invert) : channel_(std::move(channel)), invert_(invert) {}

  [[nodiscard]] bool Wants(std::string_view channel);

 private:
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
  };

  std::regex channel_;
  bool invert_;
  std::unordered_map<std::string, bool, Hash, std::equal_to<>> known_;  // expressions are slow
};

}  // namespace axlecast
