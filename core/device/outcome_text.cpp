#include "core/device/outcome_text.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstdarg>
#include <cstdio>
#include <utility>

namespace axlecast {

std::string Text(const char* format, ...) {
  std::array<char, 201> buffer{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer.data(), buffer.size(), format, arguments);
  va_end(arguments);
  return buffer.data();
}

std::string HexText(Bytes bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    if (!text.empty()) text += ' ';
    text += Text("%02X", unsigned{byte});
  }
  return text;
}

double Degrees(std::int64_t counts, int single_turn_bits) {
  return static_cast<double>(counts) * 360 / static_cast<double>(std::int64_t{1} << single_turn_bits);
}

std::int64_t CircularDistance(std::int64_t a, std::int64_t b, std::int64_t counts_per_turn) {
  const std::int64_t forward = ((a - b) % counts_per_turn + counts_per_turn) % counts_per_turn;
  return std::min(forward, counts_per_turn - forward);
}

Outcome Final(CommandState state, std::int32_t reason, std::string text) {
  Outcome outcome;
  outcome.state = state;
  outcome.reason = reason;
  outcome.text = std::move(text);
  outcome.progress = 1;
  return outcome;
}

Outcome RefusedOutcome(const Error& error) {
  const bool expired = error.reason == command_status_t::REASON_DEADLINE;
  return Final(expired ? CommandState::kExpired : CommandState::kRejected, error.reason,
               "nothing was done: " + error.text);
}

Outcome Rejected(std::int32_t reason, std::string_view why) {
  return Final(CommandState::kRejected, reason, "nothing was done: " + std::string(why));
}

Outcome Succeeded(bool verified, std::string text) {
  Outcome outcome = Final(CommandState::kSucceeded, command_status_t::REASON_NONE, std::move(text));
  outcome.verified = verified;
  return outcome;
}

}  // namespace axlecast
