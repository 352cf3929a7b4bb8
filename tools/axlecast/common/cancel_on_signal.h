#pragma once

#include <signal.h>

#include <atomic>

namespace axlecast {

// While it lives the first SIGINT or SIGTERM asks for cancellation; the second ends the program.
class CancelOnSignal {
 public:
  CancelOnSignal() {
    requested_ = false;
    struct sigaction action {};
    action.sa_handler = [](int) { requested_ = true; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(SIGINT, &action, &interrupt_);
    sigaction(SIGTERM, &action, &terminate_);
  }
  ~CancelOnSignal() {
    sigaction(SIGINT, &interrupt_, nullptr);
    sigaction(SIGTERM, &terminate_, nullptr);
  }
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  [[nodiscard]] static const std::atomic<bool>& requested() { return requested_; }

 private:
  static inline std::atomic<bool> requested_ = false;
  struct sigaction interrupt_ {};
  struct sigaction terminate_ {};
};

}  // namespace axlecast
