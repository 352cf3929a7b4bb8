#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/settings.h"

namespace axlecast::tsubaki_sc {

// The passwords of one unit, known by their names. Each is read from its place when it is needed.
class PasswordTable {
 public:
  PasswordTable(const ScSettings& settings, SecretSource& source)
      : settings_(settings), source_(source), active_(settings.password) {}

  // The one that the unit has now; empty: the configuration names none.
  [[nodiscard]] const std::string& active() const { return active_; }
  [[nodiscard]] bool Has(std::string_view name) const { return settings_.passwords.contains(name); }
  void Use(const std::string& name) { active_ = name; }

  // Reads a password. The error never shows its content.
  [[nodiscard]] Result<Secret> Read(std::string_view name) const;

 private:
  const ScSettings& settings_;
  SecretSource& source_;
  std::string active_;
};

// Logs the unit in or out: reads AI 300, writes the password to AO 100-107 only if the state is the other one, and
// reads AI 300 again. Writing a password changes the state, in or out (guideline 6, note 1; 11), so it is never written
// unless the state was just read: not after a failed exchange, and not 10 s after the reading.
// A password that the unit refused (error 04) is never written again until Allow.
class Login {
 public:
  enum class Progress : std::uint8_t { kGoing, kDone, kFailed };

  // `log_out`: the unit is logged out again after a command that logged it in.
  Login(const Requests& requests, const PasswordTable& passwords, const PasswordFormat& format, bool log_out)
      : requests_(requests), passwords_(passwords), format_(format), log_out_(log_out) {}
  ~Login() { Wipe(frame_); }
  Login(const Login&) = delete;
  Login& operator=(const Login&) = delete;

  [[nodiscard]] bool active() const { return stage_ != Stage::kNone; }
  [[nodiscard]] LoginGoal goal() const { return goal_; }  // while active
  // The password is to be written next.
  [[nodiscard]] bool writing() const { return stage_ == Stage::kWrite; }
  // Returns an error if there is no password, or if the unit has refused it.
  [[nodiscard]] Result<> CheckPassword() const;
  // Returns false if a login has no password (see problem()). A logout reads the state first: the unit may be logged out
  // already.
  [[nodiscard]] bool Start(LoginGoal goal);
  [[nodiscard]] Exchange Next(MonoNs now) const;
  [[nodiscard]] Progress OnAnswer(const Answer& answer);
  // An exchange failed: the unit may have been off.
  void OnDoubt();
  // The unit is gone.
  void Abort(std::string problem);

  // AI 300 was read, for any purpose.
  void OnStatusRead(bool logged_in);
  // Returns true if the unit was logged in for a command, and must be logged out after it.
  [[nodiscard]] bool owes_log_out() const { return owes_; }
  // The unit stays logged in until the command log_out or the loss of its power: log_in was commanded, or its password is
  // not known any more.
  void Keep();

  [[nodiscard]] const std::string& problem() const { return problem_; }  // after a failure
  [[nodiscard]] bool wrong_password() const { return wrong_password_; }
  void Allow() { wrong_password_ = false; }

 private:
  enum class Stage : std::uint8_t { kNone, kLook, kWrite, kVerify };

  Progress OnStatus(const Answer& answer);
  Progress Write(const Answer& answer);
  Progress OnWritten(const Answer& answer);
  Progress Fail(std::string problem);

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
