#include "tools/axlecast/common/screen.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string_view>

#include "core/base/safe_text.h"

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

}  // namespace axlecast
