#pragma once

#include <regex>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// Compiles a regular expression (ECMAScript) that an operator has typed.
[[nodiscard]] Result<std::regex> CompileExpression(const std::string& text);

}  // namespace axlecast
