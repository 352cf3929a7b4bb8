#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/device/operation.h"

namespace axlecast {

// The constants of command_status_t as words: STATE_SUCCEEDED is "succeeded", REASON_NO_PERMIT "no_permit".
// "unknown" for a value that this version does not know.
[[nodiscard]] std::string_view StateName(std::int8_t state);
[[nodiscard]] std::string_view ReasonName(std::int32_t reason);
[[nodiscard]] std::string_view FindingName(std::int8_t finding);
// FINDING_* of a change `finding` (OperationSpec::verified_by_operation); FINDING_CANNOT_TELL for any other word.
[[nodiscard]] std::int8_t FindingOf(std::string_view word);

// Whether what was refused for this reason may be accepted later, as it is: the state of the machine is in the way, and
// neither the command, nor who sends it, nor the machine's file. False for a reason that this version does not know.
[[nodiscard]] bool IsTemporary(std::int32_t reason);

[[nodiscard]] bool IsFinalState(std::int8_t state);

}  // namespace axlecast
