#pragma once

#include <axlecast/command_body_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <cstdint>

#include "core/base/time.h"
#include "core/command/operation_check.h"

namespace axlecast {

// Of a command that was just read; STATE_UNKNOWN. `digest`: of its body, 0 for a question.
[[nodiscard]] command_status_t StatusOf(const command_body_t& body, std::int64_t digest);

// The final status of one that is refused: EXPIRED when its time was over, else REJECTED.
[[nodiscard]] command_status_t Refused(command_status_t status, const Refusal& refusal, Timestamp now);

}  // namespace axlecast
