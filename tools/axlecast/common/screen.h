#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// A live picture on the terminal (standard output): on its second screen, so that what stood there before comes
// back at the end. Lines that are too long or too many for the terminal are cut by the terminal.
class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  void Draw(const std::vector<std::string>& lines);

  // Whether standard output is a terminal that understands this.
  [[nodiscard]] static bool Usable();
};

// One redraw of the picture: five times a second.
inline constexpr int kRedrawMs = 200;

// Writes all of `text` to standard output, as TerminalText: for what a person may read. False when its reader is gone.
[[nodiscard]] bool WriteOut(std::string_view text);

// The same byte for byte: for data, and for what steers the terminal.
[[nodiscard]] bool WriteBytes(std::string_view bytes);

}  // namespace axlecast
