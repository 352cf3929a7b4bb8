#include "drivers/tsubaki_sc/access.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/kit/read_back.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

// A reading of the login state older than this is read again before the password is written.
constexpr MonoNs kFresh = 10 * kSecond;

const char* Name(bool logged_in) { return logged_in ? "logged in" : "logged out"; }

}  // namespace

Result<Secret> PasswordTable::Read(std::string_view name) const {
  const auto place = settings_.passwords.find(name);
  const std::string shown(name);
  if (place == settings_.passwords.end()) return Failure("the configuration has no password named " + shown);
  Result<Secret> secret = source_.Read(place->second);
  if (!secret) return Failure("password " + shown + ": " + secret.error().text);
  if (IsPassword(secret->text())) return secret;
  return Failure("password " + shown +
                 ": its file does not hold a password: 8 to 16 characters from ! to ~, no blanks");
}

Result<> Login::CheckPassword() const {
  if (passwords_.active().empty()) {
    return Failure("the unit is logged out, and the configuration names no password: add passwords and password");
  }
  if (!wrong_password_) return {};
  return Failure("the unit refused password " + passwords_.active() + " before; correct its file, then log_in");
}

bool Login::Start(LoginGoal goal) {
  Wipe(frame_);
  goal_ = goal;
  failures_ = 0;
  writes_ = 0;
  answered_ = false;
  if (const Result<> password = CheckPassword(); goal == LoginGoal::kIn && !password) {
    problem_ = password.error().text;
    return false;
  }
  stage_ = Stage::kLook;
  return true;
}

Exchange Login::Next(MonoNs now) const {
  if (stage_ == Stage::kWrite && now - looked_at_ <= kFresh) return requests_.Secret(frame_);
  return requests_.Read(kLoginStatus);
}

Login::Progress Login::OnAnswer(const Answer& answer) {
  return IsLogin(answer.request) ? OnWritten(answer) : OnStatus(answer);
}

Login::Progress Login::OnStatus(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return Progress::kGoing;
    return Fail("the login status could not be read: " + CauseOf(answer));
  }
  const bool logged_in = answer.reply.Register(0) == kSaysLoggedIn;
  if (logged_in == (goal_ == LoginGoal::kIn)) {
    Wipe(frame_);
    stage_ = Stage::kNone;
    wrong_password_ = wrong_password_ && goal_ != LoginGoal::kIn;
    return Progress::kDone;
  }
  if (stage_ == Stage::kVerify && answered_) {
    return Fail(Text("the unit took the password, but reports %s", Name(logged_in)));
  }
  if (writes_ >= kTries)
    return Fail(Text("the unit answered none of %d logins, and reports %s", writes_, Name(logged_in)));
  return Write(answer);
}

// The state was just read: it is the other one.
Login::Progress Login::Write(const Answer& answer) {
  if (const Result<> usable = CheckPassword(); !usable) return Fail(usable.error().text);
  const Result<Secret> secret = passwords_.Read(passwords_.active());
  if (!secret) return Fail(secret.error().text);
  frame_ = WritePassword(requests_.address(), kLoginBlock, secret->text(), format_);
  looked_at_ = answer.end;
  stage_ = Stage::kWrite;
  return Progress::kGoing;
}

Login::Progress Login::OnWritten(const Answer& answer) {
  Wipe(frame_);
  ++writes_;
  if (answer.refused_for_login()) {
    wrong_password_ = true;
    return Fail("the unit refused password " + passwords_.active() +
                ": it is wrong; correct its file, then log_in");
  }
  if (answer.refused()) return Fail("the unit did not take the password: " + CauseOf(answer));
  owes_ = owes_ || (goal_ == LoginGoal::kIn && log_out_ && !keeps_);
  answered_ = answer.ok();
  stage_ = Stage::kVerify;  // if its reply is lost, AI 300 shows whether it arrived
  return Progress::kGoing;
}

void Login::OnDoubt() {
  if (stage_ != Stage::kWrite) return;
  Wipe(frame_);
  stage_ = Stage::kLook;
}

void Login::OnStatusRead(bool logged_in) {
  if (logged_in) return;
  owes_ = false;
  keeps_ = false;
}

void Login::Keep() {
  owes_ = false;
  keeps_ = true;
}

void Login::Abort(std::string problem) {
  if (active()) static_cast<void>(Fail(std::move(problem)));
}

Login::Progress Login::Fail(std::string problem) {
  Wipe(frame_);
  stage_ = Stage::kNone;
  problem_ = std::move(problem);
  return Progress::kFailed;
}

// The login itself is the device's; asked for a request of its own, it only looks.
std::optional<Outcome> LogIn::OnAnswer(const Answer& answer) {
  if (!answer.ok()) return GiveUp(command_status_t::REASON_DEVICE_REFUSED, CauseOf(answer));
  const bool logged_in = answer.reply.Register(0) == kSaysLoggedIn;
  if (logged_in == (goal_ == LoginGoal::kIn)) return OnLoginDone();
  return GiveUp(command_status_t::REASON_DEVICE_REFUSED,
                logged_in ? "it reports logged in" : "it reports logged out");
}

std::optional<Outcome> LogIn::OnLoginDone() {
  const bool in = goal_ == LoginGoal::kIn;
  Outcome outcome = Verified(in ? "the unit reports logged in, until log_out or until its power goes off"
                                : "the unit reports logged out");
  outcome.changes.push_back({"logged_in", "", in ? "1" : "0"});
  return outcome;
}

Outcome LogIn::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason,
               (goal_ == LoginGoal::kIn ? "not logged in: " : "not logged out: ") + cause);
}

Result<bool> PasswordComparison::Holds(Bytes registers) const {
  const Result<Secret> secret = passwords_.Read(name_);
  if (!secret) return Failure(secret.error());
  return HoldsPassword(registers, secret->text(), format_.order);
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
  const Result<bool> holds = comparison_.Holds(answer.reply.data);
  if (!holds) return GiveUp(Reason::REASON_NOT_PERMITTED, holds.error().text);
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
                    "the unit is logged out, and then does not show its password: log_in first");
  }
  const Result<bool> holds = comparison_.Holds(answer.reply.data);
  if (!holds) return GiveUp(Reason::REASON_NOT_PERMITTED, holds.error().text);
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
