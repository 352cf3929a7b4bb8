#pragma once

#include <cstdint>
#include <string>

#include "drivers/tsubaki_sc/answer.h"
#include "drivers/tsubaki_sc/password_book.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

// Logs the unit in: reads AI 300, writes the password to AO 100-107 only when that says logged out, reads AI 300
// again. Writing a password changes the state (guideline 6, note 1), so it might log out a unit that is logged in.
// A password that the unit refused (error 04) is never written again until Allow.
class Login {
 public:
  enum class Result : std::uint8_t { kGoing, kLoggedIn, kFailed };

  Login(const Requests& requests, const PasswordBook& passwords, const PasswordFormat& format)
      : requests_(requests), passwords_(passwords), format_(format) {}
  ~Login() { Wipe(frame_); }
  Login(const Login&) = delete;
  Login& operator=(const Login&) = delete;

  [[nodiscard]] bool active() const { return stage_ != Stage::kNone; }
  // Why it has nothing to log in with; empty when it has.
  [[nodiscard]] std::string Obstacle() const;
  // False when there is an obstacle: problem() says it.
  [[nodiscard]] bool Start();
  [[nodiscard]] Exchange Next() const;
  [[nodiscard]] Result OnAnswer(const Answer& answer);
  // The unit is gone.
  void Abort(std::string problem);

  [[nodiscard]] const std::string& problem() const { return problem_; }  // after a failure
  [[nodiscard]] bool wrong_password() const { return wrong_password_; }
  void Allow() { wrong_password_ = false; }

 private:
  enum class Stage : std::uint8_t { kNone, kLook, kWrite, kVerify };

  Result OnStatus(const Answer& answer);
  Result OnWritten(const Answer& answer);
  Result Fail(std::string problem);

  const Requests& requests_;
  const PasswordBook& passwords_;
  const PasswordFormat& format_;
  Stage stage_ = Stage::kNone;
  Frame frame_;  // the login; holds the password from kLook's reply to kWrite's end
  int failures_ = 0;
  bool wrong_password_ = false;
  std::string problem_;
};

}  // namespace axlecast::tsubaki_sc
