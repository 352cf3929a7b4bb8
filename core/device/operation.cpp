#include "core/device/operation.h"

#include <axlecast/command_status_t.hpp>

namespace axlecast {

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
