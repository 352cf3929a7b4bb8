#include "tools/axlecast/common/terminal.h"

#include <unistd.h>
#include <cerrno>
#include <cstdlib>
#include <iostream>

#include "core/base/text.h"
#include "core/messages/json/field.h"

namespace axlecast {
namespace {

// ECMA-48 and xterm: second screen, no wrapping, no cursor; and back.
constexpr const char* kEnter = "\x1b[?1049h\x1b[?7l\x1b[?25l";
constexpr const char* kLeave = "\x1b[?25h\x1b[?7h\x1b[?1049l";

}  // namespace

Screen::Screen() { static_cast<void>(WriteBytes(kEnter)); }

Screen::~Screen() { static_cast<void>(WriteBytes(kLeave)); }

void Screen::Draw(const std::vector<std::string>& lines) {
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += "\x1b[" + std::to_string(i + 1) + ";1H" + TerminalText(lines[i]) + "\x1b[K";
  }
  text += "\x1b[J";
  static_cast<void>(WriteBytes(text));
}

bool Screen::Usable() {
  const char* terminal = std::getenv("TERM");
  return isatty(STDOUT_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

bool WriteOut(std::string_view text) { return WriteBytes(TerminalText(text)); }

bool WriteBytes(std::string_view bytes) {
  std::string_view rest = bytes;
  while (!rest.empty()) {
    const ssize_t written = write(STDOUT_FILENO, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

void Show(const nlohmann::ordered_json& json, const std::string& text, bool as_json) {
  static_cast<void>(WriteOut(as_json ? JsonLine(json) + '\n' : text));
}

int Fail(std::string_view error, int exit_code) {
  std::cerr << error << '\n';
  return exit_code;
}

bool CanAsk(std::string_view what) {
  if (isatty(STDIN_FILENO) == 1) return true;
  std::cerr << what << " asks first, but standard input is not a terminal: add --yes\n";
  return false;
}

bool Confirmed() {
  std::cerr << "Do it? [y/N] ";
  std::string answer;
  std::getline(std::cin, answer);
  if (answer == "y" || answer == "Y" || answer == "yes") return true;
  std::cerr << "nothing was done\n";
  return false;
}

}  // namespace axlecast
