#pragma once

#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// A regular expression (ECMAScript) over a whole channel name. Almost all of them are a text, a text and `.*`, or a group of
// texts before these: DRIVER_COMMAND/rs485-0, TIME/.*, (POSITION|DEVICE)/.*. Such an expression is compared as text, which
// takes nanoseconds instead of microseconds.
class ChannelPattern {
 public:
  // Returns nothing if the expression is invalid.
  [[nodiscard]] static std::optional<ChannelPattern> Of(const std::string& expression);

  [[nodiscard]] bool Matches(const std::string& name) const;
  // Returns true if names are compared as text.
  [[nodiscard]] bool IsText() const { return !regex_; }

 private:
  ChannelPattern() = default;

  std::vector<std::string> texts_;  // the name is one of them, or begins with one if `open_`
  bool open_ = false;               // `.*` follows
  std::optional<std::regex> regex_;
};

}  // namespace axlecast
