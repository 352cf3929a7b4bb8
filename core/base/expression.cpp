#include "core/base/expression.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestExpression = 1'000;  // characters; the library's parser recurses

}  // namespace

Result<std::regex> CompileExpression(const std::string& text) {
  if (text.size() > kLongestExpression) {
    return Failure("a regular expression has at most " + std::to_string(kLongestExpression) + " characters");
  }
  try {
    return std::regex(text, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error& error) {
    return Failure("'" + text + "' is no regular expression (" + error.what() +
                   "); for example ^POSITION/ or 'axis1$|axis2$'");
  }
}

}  // namespace axlecast
