#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/device/operation.h"

namespace axlecast {

// printf's formats, cut to the 200 bytes that an outcome may have.
[[nodiscard]] __attribute__((format(printf, 1, 2))) std::string Text(const char* format, ...);

// "A1 05"
[[nodiscard]] std::string HexText(Bytes bytes);

// Shaft angle of single-turn counts, degrees.
[[nodiscard]] double Degrees(std::int64_t counts, int single_turn_bits);

// The shortest way between two single-turn positions, counts, 0 or more.
[[nodiscard]] std::int64_t CircularDistance(std::int64_t a, std::int64_t b, std::int64_t counts_per_turn);

[[nodiscard]] Outcome Final(CommandState state, std::int32_t reason, std::string text);
// Returns the outcome of a command that was refused before anything was sent: EXPIRED for REASON_DEADLINE, else REJECTED.
// Its text is "nothing was done: " and the error.
[[nodiscard]] Outcome RefusedOutcome(const Error& error);
// "nothing was done: " and why.
[[nodiscard]] Outcome Rejected(std::int32_t reason, std::string_view why);
[[nodiscard]] Outcome Succeeded(bool verified, std::string text);
[[nodiscard]] inline Outcome Verified(std::string text) { return Succeeded(true, std::move(text)); }

}  // namespace axlecast
