#include "drivers/tsubaki_sc/password_change.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"
#include "drivers/kit/read_back.h"
#include "drivers/kit/refusal.h"

namespace axlecast::tsubaki_sc {

using Reason = command_status_t;

std::optional<bool> PasswordComparison::Holds(Bytes registers) {
  Secret secret;
  problem_ = passwords_.Read(name_, secret);
  if (!problem_.empty()) return std::nullopt;
  return HoldsPassword(registers, secret.text(), format_.order);
}

Exchange ReadPassword(const Requests& requests) { return requests.Secret(requests.Read(kPassword).request); }

PasswordChange::PasswordChange(const Requests& requests, const Frame& frame, PasswordComparison comparison,
                               PasswordTable& passwords, Login& login, DeviceOutput& output)
    : requests_(requests),
      frame_(frame),
      comparison_(std::move(comparison)),
      passwords_(passwords),
      login_(login),
      output_(output) {}

Exchange PasswordChange::Next() const { return verifying_ ? ReadPassword(requests_) : requests_.Secret(frame_); }

std::optional<Outcome> PasswordChange::OnAnswer(const Answer& answer) {
  return verifying_ ? OnReadBack(answer) : OnWritten(answer);
}

std::optional<Outcome> PasswordChange::OnWritten(const Answer& answer) {
  Wipe(frame_);
  if (answer.refused()) {
    sent_ = false;
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the password is as it was: the unit refused the new one: " + CauseOf(answer));
  }
  output_.OnNonVolatileWrite();
  verifying_ = true;
  return std::nullopt;
}

std::optional<Outcome> PasswordChange::OnReadBack(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return std::nullopt;
    return GiveUp(ReasonOf(answer), CauseOf(answer));
  }
  const std::optional<bool> holds = comparison_.Holds(answer.reply.data);
  if (!holds) return GiveUp(Reason::REASON_NOT_PERMITTED, comparison_.problem());
  if (!*holds) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 "the unit's password reads differently from " + comparison_.name());
  }
  passwords_.Use(comparison_.name());
  login_.Allow();
  return Verified("the unit has password " + comparison_.name() + " now: write `password: " + comparison_.name() +
                  "` into the configuration before the driver starts again");
}

Outcome PasswordChange::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(CommandState::kFailed, reason, "the password is as it was: " + cause);
  // Which password would log the unit out is not known.
  login_.Keep();
  return Final(CommandState::kIndeterminate, reason,
               "the new password was sent, but could not be read back: " + cause +
                   "; the unit stays logged in: check_password, then log_out");
}

std::optional<Outcome> PasswordCheck::OnAnswer(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return std::nullopt;
    const bool login = answer.refused_for_login();
    return GiveUp(ReasonOf(answer), login ? "the unit is logged out: log_in first" : CauseOf(answer));
  }
  if (!looked_) {
    looked_ = answer.reply.Register(0) == kSaysLoggedIn;
    if (looked_) return std::nullopt;
    return Rejected(Reason::REASON_DEVICE_REFUSED,
                    "the unit is logged out, and then does not tell its password: log_in first");
  }
  const std::optional<bool> holds = comparison_.Holds(answer.reply.data);
  if (!holds) return GiveUp(Reason::REASON_NOT_PERMITTED, comparison_.problem());
  if (*holds) passwords_.Use(comparison_.name());
  Outcome outcome =
      Verified((*holds ? "the unit has password " : "the unit has another password than ") + comparison_.name());
  outcome.changes.push_back(FindingChange(FindingWord(*holds)));
  return outcome;
}

Outcome PasswordCheck::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason, "the password could not be compared: " + cause);
}

}  // namespace axlecast::tsubaki_sc
