#pragma once

#include <iostream>
#include <string_view>

namespace axlecast {

// Writes the error as a line to standard error, and returns the exit code.
[[nodiscard]] inline int Fail(std::string_view error, int exit_code) {
  std::cerr << error << '\n';
  return exit_code;
}

}  // namespace axlecast
