#pragma once

#include <map>
#include <optional>
#include <regex>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// Selects channels by a regular expression (ECMAScript) that is searched for anywhere in their names. With `invert` it selects
// the channels that do not match. Without an expression it selects all channels.
class ChannelFilter {
 public:
  // Returns an error, and leaves the filter as it was, if the expression is invalid.
  [[nodiscard]] Result<> Set(const std::string& expression, bool invert);

  [[nodiscard]] bool Matches(std::string_view channel);

 private:
  std::optional<std::regex> expression_;
  bool invert_ = false;
  std::map<std::string, bool, std::less<>> known_;  // results: a log has few channels, and many events of each
};

}  // namespace axlecast
