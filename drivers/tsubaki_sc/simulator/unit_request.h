#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/inline_bytes.h"
#include "drivers/tsubaki_sc/simulator/sc_unit.h"

namespace axlecast::tsubaki_sc::simulator {

// Error codes of guideline 5; the lowest that applies is answered.
enum class ErrorCode : std::uint8_t { kFunction = 1, kAddress = 2, kData = 3, kLogin = 4 };

// Guideline 4, notes 1-7.
[[nodiscard]] std::uint16_t ErrorCheck(Bytes message);

// Length of the command that begins so, address and error check included; 0 while that is not known, or if the
// function is not in guideline 6.
[[nodiscard]] std::size_t CommandLength(Bytes so_far);

// Executes a command and returns the response, both from the function code to the end of the data.
[[nodiscard]] std::vector<std::uint8_t> Execute(ScUnit& unit, Bytes command);
[[nodiscard]] std::vector<std::uint8_t> ErrorResponse(std::uint8_t function, std::uint8_t code);

// Whether a broadcast of this function is processed (guideline 6, note 2).
[[nodiscard]] bool IsWrite(std::uint8_t function);

}  // namespace axlecast::tsubaki_sc::simulator
