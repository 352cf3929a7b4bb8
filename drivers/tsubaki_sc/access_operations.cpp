#include <axlecast/command_status_t.hpp>
#include <utility>

#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/readout.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

constexpr std::string_view kSetPasswordName = "set_password";

bool SaysLoggedIn(const Answer& answer) { return answer.reply.Register(0) == kSaysLoggedIn; }

// log_in and log_out. log_in tries again after a wrong password, and the unit stays logged in until log_out.
class LogIn final : public Procedure {
 public:
  LogIn(const Requests& requests, LoginGoal goal) : requests_(requests), goal_(goal) {}

  [[nodiscard]] Exchange Next() const override { return requests_.Read(kLoginStatus); }
  // The device itself does the login. A request of the procedure only reads the state.
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (!answer.ok()) return GiveUp({CauseOf(answer), Reason::REASON_DEVICE_REFUSED});
    const bool logged_in = SaysLoggedIn(answer);
    if (logged_in == (goal_ == LoginGoal::kIn)) return OnLoginDone();
    return GiveUp({logged_in ? "it reports logged in" : "it reports logged out", Reason::REASON_DEVICE_REFUSED});
  }
  std::optional<Outcome> OnLoginDone() override {
    const bool in = goal_ == LoginGoal::kIn;
    Outcome outcome = Verified(in ? "the unit reports logged in, until log_out or until its power goes off"
                                  : "the unit reports logged out");
    outcome.changes = {{"logged_in", "", in ? "1" : "0"}};
    return outcome;
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    return Final(CommandState::kFailed, error.reason,
                 (goal_ == LoginGoal::kIn ? "not logged in: " : "not logged out: ") + error.text);
  }
  void OnStarted() override { started_ = true; }
  void OnLoginStarted() override { started_ = true; }
  [[nodiscard]] bool touched() const override { return started_; }
  [[nodiscard]] std::optional<LoginGoal> begins_with() const override { return goal_; }

 private:
  const Requests& requests_;
  const LoginGoal goal_;
  bool started_ = false;
};

// Compares a password that was read from AO 200-207 with the one of a name. Nothing of it is kept.
class PasswordComparison {
 public:
  PasswordComparison(const OperationContext& context, std::string name)
      : context_(context), name_(std::move(name)) {}

  [[nodiscard]] const std::string& name() const { return name_; }
  // The request that reads AO 200-207: its reply is masked.
  [[nodiscard]] Exchange Read() const {
    return context_.requests.Secret(context_.requests.Read(kPassword).request);
  }
  // Returns an error if the password of that name cannot be read.
  [[nodiscard]] Result<bool> Holds(Bytes registers) const {
    const Result<Secret> secret = context_.passwords.Read(name_);
    if (!secret) return Failure(secret.error().text, Reason::REASON_NOT_PERMITTED);
    return HoldsPassword(registers, secret->text(), context_.settings.password_format.order);
  }

 private:
  const OperationContext& context_;
  std::string name_;
};

// set_password: writes AO 200-207, reads them back, and uses the new one for logins from then on. Written once.
class PasswordChange final : public Procedure {
 public:
  // `password`: the one of that name.
  PasswordChange(const OperationContext& context, const std::string& name, const Secret& password)
      : context_(context),
        frame_(WritePassword(context.requests.address(), kPassword, password.text(),
                             context.settings.password_format)),
        comparison_(context, name) {}
  ~PasswordChange() override { Wipe(frame_); }
  PasswordChange(const PasswordChange&) = delete;
  PasswordChange& operator=(const PasswordChange&) = delete;

  [[nodiscard]] Exchange Next() const override {
    return verifying_ ? comparison_.Read() : context_.requests.Secret(frame_);
  }
  void OnStarted() override { sent_ = sent_ || !verifying_; }
  void OnLoggedOut() override { sent_ = verifying_; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    return verifying_ ? OnReadBack(answer) : OnWritten(answer);
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    if (!sent_) return Final(CommandState::kFailed, error.reason, "the password is as it was: " + error.text);
    // The password that would log the unit out is not known.
    context_.login.Keep();
    return Final(CommandState::kIndeterminate, error.reason,
                 "the new password was sent, but could not be read back: " + error.text +
                     "; the unit stays logged in: check_password, then log_out");
  }
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  std::optional<Outcome> OnWritten(const Answer& answer) {
    Wipe(frame_);
    if (answer.refused()) {
      sent_ = false;
      return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                   "the password is as it was: the unit refused the new one: " + CauseOf(answer));
    }
    context_.output.OnNonVolatileWrite();
    verifying_ = true;
    return std::nullopt;
  }

  std::optional<Outcome> OnReadBack(const Answer& answer) {
    if (!answer.ok()) {
      if (MayRepeat(answer, failures_)) return std::nullopt;
      return GiveUp(ErrorOf(answer));
    }
    const Result<bool> holds = comparison_.Holds(answer.reply.data);
    if (!holds) return GiveUp(holds.error());
    const std::string& name = comparison_.name();
    if (!*holds) {
      return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                   "the unit's password reads differently from " + name);
    }
    context_.passwords.Use(name);
    context_.login.Allow();
    return Verified("the unit has password " + name + " now: write `password: " + name +
                    "` into the configuration before the driver starts again");
  }

  const OperationContext& context_;
  Frame frame_;  // the write, with the password in it
  PasswordComparison comparison_;
  bool verifying_ = false;
  bool sent_ = false;
  int failures_ = 0;
};

// check_password: reads AI 300 and, if the unit is logged in, AO 200-207, and compares. It changes nothing, so it does
// not log in for it. The password that the unit turns out to have is used for logins from then on.
class PasswordCheck final : public Procedure {
 public:
  PasswordCheck(const OperationContext& context, std::string name)
      : context_(context), comparison_(context, std::move(name)) {}

  [[nodiscard]] Exchange Next() const override {
    return logged_in_ ? comparison_.Read() : context_.requests.Read(kLoginStatus);
  }
  std::optional<Outcome> OnAnswer(const Answer& answer) override {
    if (!answer.ok()) {
      if (MayRepeat(answer, failures_)) return std::nullopt;
      Error error = ErrorOf(answer);
      if (answer.refused_for_login()) error.text = "the unit is logged out: log_in first";
      return GiveUp(error);
    }
    if (!logged_in_) {
      logged_in_ = SaysLoggedIn(answer);
      if (logged_in_) return std::nullopt;
      return Rejected(Reason::REASON_DEVICE_REFUSED,
                      "the unit is logged out, and then does not show its password: log_in first");
    }
    const Result<bool> holds = comparison_.Holds(answer.reply.data);
    if (!holds) return GiveUp(holds.error());
    if (*holds) context_.passwords.Use(comparison_.name());
    Outcome outcome =
        Verified((*holds ? "the unit has password " : "the unit has another password than ") + comparison_.name());
    outcome.changes = {FindingChange(FindingWord(*holds))};
    return outcome;
  }
  [[nodiscard]] Outcome GiveUp(const Error& error) const override {
    return Final(CommandState::kFailed, error.reason, "the password could not be compared: " + error.text);
  }
  [[nodiscard]] bool may_log_in() const override { return false; }

 private:
  const OperationContext& context_;
  PasswordComparison comparison_;
  bool logged_in_ = false;
  int failures_ = 0;
};

// ---- commands ----

MadeProcedure MakeSetPassword(const DriverCommand& command, const OperationContext& context) {
  const std::string name(FindArgument(command.arguments, "name").value_or(""));
  if (!context.passwords.Has(name)) return BadArgument("name must be a NAME of passwords in the configuration");
  const Result<Secret> secret = context.passwords.Read(name);
  if (!secret) return NotPermitted(secret.error().text);
  return std::make_unique<PasswordChange>(context, name, *secret);
}

MadeProcedure MakeCheckPassword(const DriverCommand& command, const OperationContext& context) {
  Arguments arguments = command.arguments;
  if (const auto after = AfterArgument(arguments)) {
    if (after->operation != kSetPasswordName) return BadArgument("after must be a set_password");
    arguments = after->arguments;
  }
  std::string name(FindArgument(arguments, "name").value_or(""));
  if (!context.passwords.Has(name)) return BadArgument("name must be a NAME of passwords in the configuration");
  return std::make_unique<PasswordCheck>(context, std::move(name));
}

MadeProcedure MakeLogIn(const DriverCommand& command, const OperationContext& context) {
  const LoginGoal goal = command.operation == kLogInName ? LoginGoal::kIn : LoginGoal::kOut;
  if (context.passwords.active().empty()) {
    return NotPermitted("the configuration names no password to log in or out with");
  }
  if (goal == LoginGoal::kOut && context.settings.StaysLoggedIn()) {
    return NotPermitted(
        "motor_control keeps the unit logged in, so that a stop needs no login first: set log_out: true");
  }
  return std::make_unique<LogIn>(context.requests, goal);
}

// read_identity: product code, MFG number and version.
MadeProcedure MakeReadIdentity(const DriverCommand&, const OperationContext& context) {
  const auto show = [order = context.settings.password_format.order](const BlockReader& read) {
    const std::string product = RegisterText(read.Data(kProductCode), order);
    const std::string serial = RegisterText(read.Data(kMfgNumber), order);
    const std::string version = VersionText(read.Data(kVersion));
    Outcome outcome = Verified("product code " + product + ", MFG number " + serial + ", version " + version);
    outcome.changes = {{"product_code", "", product}, {"mfg_number", "", serial}, {"version", "", version}};
    return outcome;
  };
  return std::make_unique<Readout>(context.requests, std::vector{kProductCode, kMfgNumber, kVersion}, show);
}

}  // namespace

std::vector<Operation> AccessOperations() {
  return {
      {ReadOnly({.name = "read_identity", .help = "Reads product code, MFG number and software version"}),
       MakeReadIdentity},
      {{.name = kLogInName,
        .help = "Logs the unit in with the password in use, until log_out; also after one that was wrong",
        .verification = "AI 300 reads FF00"},
       MakeLogIn},
      {{.name = kLogOutName,
        .help = "Logs the unit out with the password in use",
        .verification = "AI 300 reads 0000"},
       MakeLogIn},
      {{.name = kSetPasswordName,
        .help = "Gives the unit the password that the configuration knows by this name, and uses it from then on",
        .arguments = {{"name", "a NAME of passwords in the configuration, never a password"}},
        .destructive = true,
        .verification = "it is read back and compared",
        .verified_by_operation = kCheckPasswordName},
       MakeSetPassword},
      {ReadOnly({.name = kCheckPasswordName,
                 .help = "Compares the unit's password with the one of this name; the unit must be logged in",
                 .arguments = {{"name", "a NAME of passwords in the configuration; needed unless `after` is given",
                                false},
                               kAfterArgument}}),
       MakeCheckPassword},
  };
}

}  // namespace axlecast::tsubaki_sc
