#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace axlecast {

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning };

// One line for the operator, when something changes: never per reading.
using Log = std::function<void(LogLevel level, std::string_view text)>;

}  // namespace axlecast
