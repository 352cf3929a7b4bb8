#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "bridge/state/pending_command.h"

namespace axlecast {

// What texts of a task and of its status say; empty where they do not.
[[nodiscard]] std::string ArgumentOf(const PendingCommand& task, std::string_view key);
[[nodiscard]] std::string ChangedTo(const command_status_t& status, std::string_view key);
// A whole decimal number.
[[nodiscard]] std::optional<std::int64_t> ParseInteger(const std::string& text);

}  // namespace axlecast
