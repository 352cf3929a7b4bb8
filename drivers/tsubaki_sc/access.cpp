#include "drivers/tsubaki_sc/access.h"

#include <utility>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {
namespace {

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
    if (MayRepeat(answer, failures_)) return Progress::kGoing;
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

}  // namespace axlecast::tsubaki_sc
