#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

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

  // Returns the name of the unit's present password; empty: the configuration names none.
  [[nodiscard]] const std::string& active() const { return active_; }
  [[nodiscard]] bool Has(std::string_view name) const { return settings_.passwords.contains(name); }
  void Use(const std::string& name) { active_ = name; }

  // Reads a password. The error never shows its content.
  [[nodiscard]] Result<Secret> Read(std::string_view name) const {
    const auto place = settings_.passwords.find(name);
    const std::string shown(name);
    if (place == settings_.passwords.end()) return Failure("the configuration has no password named " + shown);
    Result<Secret> secret = source_.Read(place->second);
    if (!secret) return Failure("password " + shown + ": " + secret.error().text);
    if (IsPassword(secret->text())) return secret;
    return Failure("password " + shown +
                   ": its file does not hold a password: 8 to 16 characters from ! to ~, no blanks");
  }

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
  // `log_out`: the unit is logged out again after a command that logged it in.
  Login(const Requests& requests, const PasswordTable& passwords, const PasswordFormat& format, bool log_out)
      : requests_(requests), passwords_(passwords), format_(format), log_out_(log_out) {}
  ~Login() { Wipe(frame_); }
  Login(const Login&) = delete;
  Login& operator=(const Login&) = delete;

  [[nodiscard]] bool active() const { return stage_ != Stage::kNone; }
  [[nodiscard]] LoginGoal goal() const { return goal_; }  // while active
  // Returns whether the password is written next.
  [[nodiscard]] bool writing() const { return stage_ == Stage::kWrite; }
  // Returns an error if there is no password, or if the unit has refused it.
  [[nodiscard]] Result<> CheckPassword() const {
    if (passwords_.active().empty()) {
      return Failure("the unit is logged out, and the configuration names no password: add passwords and password");
    }
    if (!wrong_password_) return {};
    return Failure("the unit refused password " + passwords_.active() + " before; correct its file, then log_in");
  }
  // Fails if a login has no password. A logout reads the state first: the unit may be logged out already.
  [[nodiscard]] Result<> Start(LoginGoal goal) {
    Wipe(frame_);
    goal_ = goal;
    failures_ = 0;
    writes_ = 0;
    answered_ = false;
    if (Result<> password = CheckPassword(); goal == LoginGoal::kIn && !password) return password;
    stage_ = Stage::kLook;
    return {};
  }
  [[nodiscard]] Exchange Next(MonoNs now) const {
    if (stage_ == Stage::kWrite && now - looked_at_ <= kFresh) return requests_.Secret(frame_);
    return requests_.Read(kLoginStatus);
  }
  // Returns true if the goal is reached, false to continue, or an error that ends it.
  [[nodiscard]] Result<bool> OnAnswer(const Answer& answer) {
    Result<bool> reached = IsLogin(answer.request) ? OnWritten(answer) : OnStatus(answer);
    if (!reached) Abort();
    return reached;
  }
  // An exchange failed: the unit may have been off, so its login state is read again.
  void OnUnclear() {
    if (stage_ != Stage::kWrite) return;
    Wipe(frame_);
    stage_ = Stage::kLook;
  }
  void Abort() {
    Wipe(frame_);
    stage_ = Stage::kNone;
  }

  // AI 300 was read, for any purpose.
  void OnStatusRead(bool logged_in) {
    if (logged_in) return;
    owes_ = false;
    keeps_ = false;
  }
  // Returns true if the unit was logged in for a command, and must be logged out after it.
  [[nodiscard]] bool owes_log_out() const { return owes_; }
  // The unit stays logged in until the command log_out or the loss of its power: log_in was commanded, or its password is
  // not known any more.
  void Keep() {
    owes_ = false;
    keeps_ = true;
  }

  [[nodiscard]] bool wrong_password() const { return wrong_password_; }
  void Allow() { wrong_password_ = false; }

 private:
  enum class Stage : std::uint8_t { kNone, kLook, kWrite, kVerify };

  // A reading of the login state that is older is read again before the password is written.
  static constexpr MonoNs kFresh = 10 * kSecond;

  Result<bool> OnStatus(const Answer& answer) {
    if (!answer.ok()) {
      if (MayRepeat(answer, failures_)) return false;
      return Failure("the login status could not be read: " + CauseOf(answer));
    }
    const bool logged_in = answer.reply.Register(0) == kSaysLoggedIn;
    if (logged_in == (goal_ == LoginGoal::kIn)) {
      Abort();
      wrong_password_ = wrong_password_ && goal_ != LoginGoal::kIn;
      return true;
    }
    const char* state = logged_in ? "logged in" : "logged out";
    if (stage_ == Stage::kVerify && answered_) {
      return Failure(Text("the unit took the password, but reports %s", state));
    }
    if (writes_ >= kTries) {
      return Failure(Text("the unit answered none of %d logins, and reports %s", writes_, state));
    }
    return Write(answer);
  }
  // The state was just read: it is the other one.
  Result<bool> Write(const Answer& answer) {
    if (const Result<> usable = CheckPassword(); !usable) return Failure(usable.error());
    const Result<Secret> secret = passwords_.Read(passwords_.active());
    if (!secret) return Failure(secret.error());
    frame_ = WritePassword(requests_.address(), kLoginBlock, secret->text(), format_);
    looked_at_ = answer.end;
    stage_ = Stage::kWrite;
    return false;
  }
  Result<bool> OnWritten(const Answer& answer) {
    Wipe(frame_);
    ++writes_;
    if (answer.refused_for_login()) {
      wrong_password_ = true;
      return Failure("the unit refused password " + passwords_.active() +
                     ": it is wrong; correct its file, then log_in");
    }
    if (answer.refused()) return Failure("the unit did not take the password: " + CauseOf(answer));
    owes_ = owes_ || (goal_ == LoginGoal::kIn && log_out_ && !keeps_);
    answered_ = answer.ok();
    stage_ = Stage::kVerify;  // if its reply is lost, AI 300 shows whether it arrived
    return false;
  }

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
};

}  // namespace axlecast::tsubaki_sc
