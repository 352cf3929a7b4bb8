#include "client/axlecast/command.h"
#include "core/command/command_id.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using S = command_status_t;

}  // namespace

CommandOutcome CommandResult::outcome() const {
  if (not_accepted) return CommandOutcome::kNotAccepted;
  if (!answered || status.is_final == 0) return CommandOutcome::kUnknown;
  switch (status.state) {
    case S::STATE_SUCCEEDED:
      if (prepare) return CommandOutcome::kPrepared;
      return status.verified != 0 ? CommandOutcome::kDone : CommandOutcome::kDoneUnverified;
    case S::STATE_REJECTED:
      return CommandOutcome::kRejected;
    case S::STATE_EXPIRED:
      return CommandOutcome::kExpired;
    case S::STATE_CANCELLED:
      return CommandOutcome::kCancelled;
    case S::STATE_FAILED:
      return CommandOutcome::kFailed;
    case S::STATE_INDETERMINATE:
      return CommandOutcome::kIndeterminate;
    default:
      return CommandOutcome::kUnknown;
  }
}

bool CommandResult::temporary() const {
  const CommandOutcome what = outcome();
  if (what == CommandOutcome::kNotAccepted) return can_resend;
  return (what == CommandOutcome::kRejected || what == CommandOutcome::kExpired) && IsTemporary(status.reason_code);
}

std::string_view CommandResult::reason() const { return ReasonName(status.reason_code); }

CommandToken CommandResult::token() const { return IdOf(status.token); }

}  // namespace axlecast
