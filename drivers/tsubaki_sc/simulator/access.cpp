#include "drivers/tsubaki_sc/simulator/access.h"

#include <algorithm>

namespace axlecast::tsubaki_sc::simulator {

WrittenPassword Unpadded(const Characters& characters) {
  std::size_t length = characters.size();
  while (length > 0 && (characters[length - 1] == 0x00 || characters[length - 1] == 0x20)) --length;
  WrittenPassword written;
  written.text.assign(characters.begin(), characters.begin() + static_cast<std::ptrdiff_t>(length));
  written.length_fits = length >= 8;
  written.characters_fit =
      std::all_of(written.text.begin(), written.text.end(), [](char c) { return c >= 0x21 && c <= 0x7E; });
  return written;
}

bool Access::Authenticate(std::string_view password) {
  if (password != password_) return false;
  logged_in_ = !logged_in_;
  return true;
}

Characters Access::password() const {
  Characters characters{};
  std::copy(password_.begin(), password_.end(), characters.begin());
  return characters;
}

}  // namespace axlecast::tsubaki_sc::simulator
