#include "core/base/expression.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestExpression = 1'000;  // characters; the library's parser recurses

}  // namespace

std::optional<std::regex> CompileExpression(const std::string& text, std::string& problem) {
  if (text.size() > kLongestExpression) {
    problem = "a regular expression has at most " + std::to_string(kLongestExpression) + " characters";
    return std::nullopt;
  }
  try {
    return std::regex(text, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error& error) {
    problem =
        "'" + text + "' is no regular expression (" + error.what() + "); for example ^POSITION/ or 'axis1$|axis2$'";
    return std::nullopt;
  }
}

}  // namespace axlecast
