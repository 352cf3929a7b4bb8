#include "drivers/tsubaki_sc/login.h"

#include <utility>

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

std::string Login::Obstacle() const {
  if (passwords_.active().empty()) {
    return "the unit is logged out, and the configuration names no password: add passwords and password";
  }
  if (!wrong_password_) return {};
  return "the unit refused password " + passwords_.active() + " before; mend its file, then log_in";
}

bool Login::Start() {
  failures_ = 0;
  problem_ = Obstacle();
  if (!problem_.empty()) return false;
  stage_ = Stage::kLook;
  return true;
}

Exchange Login::Next() const {
  if (stage_ == Stage::kWrite) return requests_.Secret(frame_);
  return requests_.Read(kLoginStatus);
}

Login::Result Login::OnAnswer(const Answer& answer) {
  return stage_ == Stage::kWrite ? OnWritten(answer) : OnStatus(answer);
}

Login::Result Login::OnStatus(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return Result::kGoing;
    return Fail("the login status could not be read: " + CauseOf(answer));
  }
  if (answer.reply.Register(0) == kSaysLoggedIn) {
    stage_ = Stage::kNone;
    wrong_password_ = false;
    return Result::kLoggedIn;
  }
  if (stage_ == Stage::kVerify) return Fail("the unit took the password, but says logged out");
  Secret secret;
  std::string problem = passwords_.Read(passwords_.active(), secret);
  if (!problem.empty()) return Fail(std::move(problem));
  frame_ = WritePassword(requests_.address(), kLoginBlock, secret.text(), format_);
  stage_ = Stage::kWrite;
  return Result::kGoing;
}

Login::Result Login::OnWritten(const Answer& answer) {
  Wipe(frame_);
  if (answer.refused_for_login()) {
    wrong_password_ = true;
    return Fail("the unit refused password " + passwords_.active() + ": it is wrong; mend its file, then log_in");
  }
  if (answer.refused()) return Fail("the unit did not take the login: " + CauseOf(answer));
  stage_ = Stage::kVerify;  // whether it arrived, if its reply is lost, AI 300 says
  return Result::kGoing;
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
