#pragma once

#include <signal.h>
#include <atomic>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// Exit codes of every command (docs/cli.md).
inline constexpr int kExitDone = 0;  // done, and verified
inline constexpr int kExitBad = 1;   // an input is bad, or the result is not good
inline constexpr int kExitUsage = 2;
inline constexpr int kExitRejected = 3;  // rejected, expired or cancelled: nothing was done
inline constexpr int kExitFailed = 4;
inline constexpr int kExitIndeterminate = 5;
inline constexpr int kExitNoAnswer = 6;
inline constexpr int kExitUnverifiable = 7;  // done, but the device allows no read-back
inline constexpr int kExitReplaced = 8;      // ship: another process has taken the machine over

// record, replay, log, redecode, mqtt and ship: done, but data is missing, damaged or different.
inline constexpr int kExitLosses = 3;

// A live picture on standard output. It uses the terminal's second screen, so that the previous content reappears at the
// end. The terminal cuts lines that are too long or too many.
class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void Draw(const std::vector<std::string>& lines);

  // Returns true if standard output is a terminal with a second screen.
  [[nodiscard]] static bool Usable();
};

inline constexpr int kRedrawMs = 200;  // interval between two pictures

// Writes `text` to standard output as TerminalText: safe for a terminal. Returns false if the reader is gone.
[[nodiscard]] bool WriteOut(std::string_view text);

// Writes the bytes unchanged: for data and for control sequences. Returns false if the reader is gone.
[[nodiscard]] bool WriteBytes(std::string_view bytes);

// Writes `json` as one line if `as_json`, else `text`, to standard output.
void Show(const nlohmann::ordered_json& json, const std::string& text, bool as_json);

// Prints why a command failed to standard error. Returns `exit_code`.
[[nodiscard]] int Fail(std::string_view error, int exit_code);

// Returns true if standard input is a terminal, so that the operator can be asked. Else prints that `what` needs --yes.
[[nodiscard]] bool CanAsk(std::string_view what);

// Asks the operator. Returns true for `y` or `yes`; else prints that nothing was done.
[[nodiscard]] bool Confirmed();

// During its lifetime, the first SIGINT or SIGTERM requests cancellation. The second ends the program.
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
