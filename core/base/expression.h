#pragma once

#include <optional>
#include <regex>
#include <string>

namespace axlecast {

// The regular expression (ECMAScript); nothing when `text` is none, `problem` then says why.
[[nodiscard]] std::optional<std::regex> CompileExpression(const std::string& text, std::string& problem);

}  // namespace axlecast
