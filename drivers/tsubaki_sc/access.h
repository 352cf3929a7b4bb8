#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/secret.h"
#include "core/device/device.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/requests.h"
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

// The commands log_in and log_out. log_in tries again after a wrong password,
// and the unit stays logged in until log_out.
class LogIn final : public Procedure {
 public:
  LogIn(const Requests& requests, LoginGoal goal) : requests_(requests), goal_(goal) {}

  [[nodiscard]] Exchange Next() const override { return requests_.Read(kLoginStatus); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  std::optional<Outcome> OnLoginDone() override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  void OnStarted() override { started_ = true; }
  void OnLoginStarted() override { started_ = true; }
  [[nodiscard]] bool touched() const override { return started_; }
  [[nodiscard]] std::optional<LoginGoal> begins_with() const override { return goal_; }

 private:
  const Requests& requests_;
  const LoginGoal goal_;
  bool started_ = false;
};

// Whether a password that was read from AO 200-207 is the one of that name. Nothing of it is kept.
class PasswordComparison {
 public:
  PasswordComparison(const PasswordTable& passwords, const PasswordFormat& format, std::string name)
      : passwords_(passwords), format_(format), name_(std::move(name)) {}

  [[nodiscard]] const std::string& name() const { return name_; }
  // Returns an error if the password of that name cannot be read.
  [[nodiscard]] Result<bool> Holds(Bytes registers) const;

 private:
  const PasswordTable& passwords_;
  const PasswordFormat& format_;
  std::string name_;
};

// The exchange that reads AO 200-207: its reply is masked.
[[nodiscard]] Exchange ReadPassword(const Requests& requests);

// set_password: writes AO 200-207, reads them back, and uses the new one for logins from then on. Written once.
class PasswordChange final : public Procedure {
 public:
  // `frame` is the write, with the password in it.
  PasswordChange(const Requests& requests, const Frame& frame, PasswordComparison comparison,
                 PasswordTable& passwords, Login& login, DeviceOutput& output);
  ~PasswordChange() override { Wipe(frame_); }
  PasswordChange(const PasswordChange&) = delete;
  PasswordChange& operator=(const PasswordChange&) = delete;

  [[nodiscard]] Exchange Next() const override;
  void OnStarted() override { sent_ = sent_ || !verifying_; }
  void OnLoggedOut() override { sent_ = verifying_; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  std::optional<Outcome> OnWritten(const Answer& answer);
  std::optional<Outcome> OnReadBack(const Answer& answer);

  const Requests& requests_;
  Frame frame_;
  PasswordComparison comparison_;
  PasswordTable& passwords_;
  Login& login_;
  DeviceOutput& output_;
  bool verifying_ = false;
  bool sent_ = false;
  int failures_ = 0;
};

// check_password: reads AI 300 and, if the unit is logged in, AO 200-207, and compares. It changes nothing, so it does
// not log in for it. The password that the unit turns out to have is used for logins from then on.
class PasswordCheck final : public Procedure {
 public:
  PasswordCheck(const Requests& requests, PasswordComparison comparison, PasswordTable& passwords)
      : requests_(requests), comparison_(std::move(comparison)), passwords_(passwords) {}

  [[nodiscard]] Exchange Next() const override {
    return looked_ ? ReadPassword(requests_) : requests_.Read(kLoginStatus);
  }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool may_log_in() const override { return false; }

 private:
  const Requests& requests_;
  PasswordComparison comparison_;
  PasswordTable& passwords_;
  bool looked_ = false;  // the unit is logged in
  int failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
