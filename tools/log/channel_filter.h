#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <regex>
#include <string>
#include <string_view>

namespace axlecast {

// Chooses channels by a regular expression (ECMAScript) that is found anywhere in their names; `invert`: those in which
// it is not. Without an expression, all.
class ChannelFilter {
 public:
  ChannelFilter() = default;

  // Why the expression is none; empty when it is one, and set.
  [[nodiscard]] std::string Set(const std::string& expression, bool invert);

  [[nodiscard]] bool Takes(std::string_view channel);

 private:
  std::optional<std::regex> expression_;
  bool invert_ = false;
  std::map<std::string, bool, std::less<>> known_;  // a log has few channels, and many events of each
};

}  // namespace axlecast
