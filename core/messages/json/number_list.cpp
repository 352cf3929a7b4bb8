#include "core/messages/json/number_list.h"

#include <array>
#include <charconv>
#include <cmath>

namespace axlecast {

void AppendNumber(std::string& text, double value) {
  constexpr int kDigits = 10;
  if (!std::isfinite(value)) {
    text += "null";
    return;
  }
  std::array<char, 40> digits{};
  const auto end =
      std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, kDigits);
  text.append(digits.data(), end.ptr);
}

}  // namespace axlecast
