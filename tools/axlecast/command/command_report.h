#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/axlecast/command.h"

namespace axlecast {

// 0 done and verified, or would be done; 3 rejected, expired or cancelled, 4 failed, 5 indeterminate, 6 no answer,
// 7 done but not verifiable.
[[nodiscard]] int ExitCode(const CommandResult& result);

// One flat object: `outcome` and `reason` as words, `temporary` where nothing was done, `found` as a word after an
// indeterminate outcome, `problem` where there is no outcome, and the fields of command_status_t as they came; without
// these when nothing came.
[[nodiscard]] nlohmann::ordered_json ToJson(const CommandResult& result);

// Several lines for a person: the outcome, what changed, what to do.
[[nodiscard]] std::string ToText(const CommandResult& result);

}  // namespace axlecast
