#pragma once

#include <optional>

#include "core/device/probe.h"

namespace axlecast {

// A probe that asks one question after the other. Before each the line must have been quiet for as long as the
// question wants; where it never is, somebody else speaks, and nothing more is asked.
class AskingProbe : public Probe {
 public:
  struct Question {
    Exchange exchange;
    MonoNs quiet = 0;  // before it, longer than any pause that the devices ask for
  };

  [[nodiscard]] std::optional<Step> Next(MonoNs now) const final;
  void On(const Event& event) final;

  [[nodiscard]] bool Disturbed() const final { return strays_ >= kMaxStrays; }

 protected:
  static constexpr int kMaxStrays = 50;  // in a row

  // The next question; nothing: there is none left.
  [[nodiscard]] virtual std::optional<Question> Ask() const = 0;
  // What came of it, kReply or kTimeout: `event.bytes` is never longer than a frame. Moves on to the next question.
  virtual void Judge(const Event& event) = 0;

 private:
  bool quiet_ = false;  // for long enough, since the last thing that came
  bool lost_ = false;   // the link is gone
  int strays_ = 0;
};

inline std::optional<Step> AskingProbe::Next(MonoNs) const {
  if (lost_ || Disturbed()) return std::nullopt;
  const std::optional<Question> question = Ask();
  if (!question) return std::nullopt;
  if (!quiet_) return Step{.action = WaitForIdleLine{question->quiet}, .priority = Priority::kCommand};
  return Step{.action = question->exchange, .priority = Priority::kCommand};
}

inline void AskingProbe::On(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kSilent:
      quiet_ = true;
      return;
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      quiet_ = false;
      strays_ = 0;
      return Judge(event);
    case Event::Kind::kLinkDown:
      lost_ = true;
      return;
    default:  // bytes of somebody else, or late ones
      quiet_ = false;
      ++strays_;
  }
}

}  // namespace axlecast
