#pragma once

#include <cstdint>
#include <string>

#include "drivers/tsubaki_sc/answer.h"
#include "drivers/tsubaki_sc/password_table.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

// Logs the unit in or out: reads AI 300, writes the password to AO 100-107 only when that says the other state, reads
// AI 300 again. Writing a password changes the state, in or out (guideline 6, note 1; 11), so it is never written
// unless the state was just read: not after a failed exchange, and not 10 s after the reading.
// A password that the unit refused (error 04) is never written again until Allow.
class Login {
 public:
  enum class Result : std::uint8_t { kGoing, kDone, kFailed };

  // `log_out`: the unit is logged out again after an order that logged it in.
  Login(const Requests& requests, const PasswordTable& passwords, const PasswordFormat& format, bool log_out)
      : requests_(requests), passwords_(passwords), format_(format), log_out_(log_out) {}
  ~Login() { Wipe(frame_); }
  Login(const Login&) = delete;
  Login& operator=(const Login&) = delete;

  [[nodiscard]] bool active() const { return stage_ != Stage::kNone; }
  [[nodiscard]] LoginGoal goal() const { return goal_; }  // while active
  // The password is to be written next.
  [[nodiscard]] bool writing() const { return stage_ == Stage::kWrite; }
  // Why it has nothing to log in or out with; empty when it has.
  [[nodiscard]] std::string Obstacle() const;
  // False when there is an obstacle: problem() says it. A logout looks first: the unit may be logged out already.
  [[nodiscard]] bool Start(LoginGoal goal);
  [[nodiscard]] Exchange Next(MonoNs now) const;
  [[nodiscard]] Result OnAnswer(const Answer& answer);
  // An exchange failed: the unit may have been off.
  void OnDoubt();
  // The unit is gone.
  void Abort(std::string problem);

  // AI 300 was read, whoever asked for it.
  void OnStatusRead(bool logged_in);
  // The unit was logged in for an order, and is to be logged out when that has ended.
  [[nodiscard]] bool owes_log_out() const { return owes_; }
  // It stays logged in, until it is logged out on order or by its power: somebody wants that, or its password is not
  // known any more.
  void Keep();

  [[nodiscard]] const std::string& problem() const { return problem_; }  // after a failure
  [[nodiscard]] bool wrong_password() const { return wrong_password_; }
  void Allow() { wrong_password_ = false; }

 private:
  enum class Stage : std::uint8_t { kNone, kLook, kWrite, kVerify };

  Result OnStatus(const Answer& answer);
  Result Write(const Answer& answer);
  Result OnWritten(const Answer& answer);
  Result Fail(std::string problem);

  const Requests& requests_;
  const PasswordTable& passwords_;
  const PasswordFormat& format_;
  const bool log_out_;
  LoginGoal goal_ = LoginGoal::kIn;
  Stage stage_ = Stage::kNone;
  Frame frame_;  // holds the password from kLook's reply to kWrite's end
  MonoNs looked_at_ = 0;
  int failures_ = 0;
  int writes_ = 0;
  bool answered_ = false;  // the last write
  bool wrong_password_ = false;
  bool owes_ = false;
  bool keeps_ = false;
  std::string problem_;
};

}  // namespace axlecast::tsubaki_sc
