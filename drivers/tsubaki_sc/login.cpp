#include "drivers/tsubaki_sc/login.h"

#include <utility>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {
namespace {

// A reading of the login state older than this is read again before the password is written.
constexpr MonoNs kFresh = 10 * kSecond;

const char* Name(bool logged_in) { return logged_in ? "logged in" : "logged out"; }

}  // namespace

std::string Login::Obstacle() const {
  if (passwords_.active().empty()) {
    return "the unit is logged out, and the configuration names no password: add passwords and password";
  }
  if (!wrong_password_) return {};
  return "the unit refused password " + passwords_.active() + " before; mend its file, then log_in";
}

bool Login::Start(LoginGoal goal) {
  Wipe(frame_);
  goal_ = goal;
  failures_ = 0;
  writes_ = 0;
  answered_ = false;
  problem_ = goal == LoginGoal::kIn ? Obstacle() : "";
  if (!problem_.empty()) return false;
  stage_ = Stage::kLook;
  return true;
}

Exchange Login::Next(MonoNs now) const {
  if (stage_ == Stage::kWrite && now - looked_at_ <= kFresh) return requests_.Secret(frame_);
  return requests_.Read(kLoginStatus);
}

Login::Result Login::OnAnswer(const Answer& answer) {
  return IsLogin(answer.request) ? OnWritten(answer) : OnStatus(answer);
}

Login::Result Login::OnStatus(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return Result::kGoing;
    return Fail("the login status could not be read: " + CauseOf(answer));
  }
  const bool logged_in = answer.reply.Register(0) == kSaysLoggedIn;
  if (logged_in == (goal_ == LoginGoal::kIn)) {
    Wipe(frame_);
    stage_ = Stage::kNone;
    wrong_password_ = wrong_password_ && goal_ != LoginGoal::kIn;
    return Result::kDone;
  }
  if (stage_ == Stage::kVerify && answered_) {
    return Fail(Text("the unit took the password, but says %s", Name(logged_in)));
  }
  if (writes_ >= kTries)
    return Fail(Text("the unit answered none of %d logins, and says %s", writes_, Name(logged_in)));
  return Write(answer);
}

// The state was just read: it is the other one.
Login::Result Login::Write(const Answer& answer) {
  if (std::string problem = Obstacle(); !problem.empty()) return Fail(std::move(problem));
  Secret secret;
  std::string problem = passwords_.Read(passwords_.active(), secret);
  if (!problem.empty()) return Fail(std::move(problem));
  frame_ = WritePassword(requests_.address(), kLoginBlock, secret.text(), format_);
  looked_at_ = answer.end;
  stage_ = Stage::kWrite;
  return Result::kGoing;
}

Login::Result Login::OnWritten(const Answer& answer) {
  Wipe(frame_);
  ++writes_;
  if (answer.refused_for_login()) {
    wrong_password_ = true;
    return Fail("the unit refused password " + passwords_.active() + ": it is wrong; mend its file, then log_in");
  }
  if (answer.refused()) return Fail("the unit did not take the password: " + CauseOf(answer));
  owes_ = owes_ || (goal_ == LoginGoal::kIn && log_out_ && !keeps_);
  answered_ = answer.ok();
  stage_ = Stage::kVerify;  // whether it arrived, if its reply is lost, AI 300 says
  return Result::kGoing;
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

Login::Result Login::Fail(std::string problem) {
  Wipe(frame_);
  stage_ = Stage::kNone;
  problem_ = std::move(problem);
  return Result::kFailed;
}

}  // namespace axlecast::tsubaki_sc
