#pragma once

#include <optional>

#include "core/device/probe.h"

namespace axlecast {

// A probe that sends one request after the other. Before each, the line must be idle for the time that the question
// states. If it never is, another device transmits, and the probe ends.
class AskingProbe : public Probe {
 public:
  struct Question {
    Exchange exchange;
    MonoNs quiet = 0;  // idle time before it, longer than any pause that the devices need
  };

  [[nodiscard]] std::optional<Step> Next(MonoNs) const final {
    if (lost_ || Disturbed()) return std::nullopt;
    const std::optional<Question> question = Ask();
    if (!question) return std::nullopt;
    if (!quiet_) return Step{.action = WaitForIdleLine{question->quiet}, .priority = Priority::kCommand};
    return Step{.action = question->exchange, .priority = Priority::kCommand};
  }
  void On(const Event& event) final {
    switch (event.kind) {
      case Event::Kind::kSilent:
        quiet_ = true;
        return;
      case Event::Kind::kReply:
      case Event::Kind::kTimeout:
        quiet_ = false;
        strays_ = 0;
        return Evaluate(event);
      case Event::Kind::kLinkDown:
        lost_ = true;
        return;
      default:  // bytes of another device, or late ones
        quiet_ = false;
        ++strays_;
    }
  }
  [[nodiscard]] bool Disturbed() const final { return strays_ >= kMaxStrays; }

 protected:
  static constexpr int kMaxStrays = 50;  // in a row

  // Returns the next question; nothing after the last one.
  [[nodiscard]] virtual std::optional<Question> Ask() const = 0;
  // Evaluates the answer, kReply or kTimeout, and moves on to the next question. `event.bytes` is at most a frame.
  virtual void Evaluate(const Event& event) = 0;

 private:
  bool quiet_ = false;  // the line has been idle since the last bytes
  bool lost_ = false;   // the link is down
  int strays_ = 0;
};

}  // namespace axlecast
