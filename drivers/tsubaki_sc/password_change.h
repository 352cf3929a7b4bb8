#pragma once

#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/tsubaki_sc/login.h"
#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// Whether a password that was read from AO 200-207 is the one of that name. Nothing of it is kept.
class PasswordComparison {
 public:
  PasswordComparison(const PasswordTable& passwords, const PasswordFormat& format, std::string name)
      : passwords_(passwords), format_(format), name_(std::move(name)) {}

  [[nodiscard]] const std::string& name() const { return name_; }
  // Nothing when the password of that name cannot be read: problem() says why.
  [[nodiscard]] std::optional<bool> Holds(Bytes registers);
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  const PasswordTable& passwords_;
  const PasswordFormat& format_;
  std::string name_;
  std::string problem_;
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

// check_password: reads AI 300, and when that says logged in AO 200-207, and compares. It changes nothing, so it does
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
  bool looked_ = false;  // it says logged in
  int failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
