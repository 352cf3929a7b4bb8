#include "core/base/secret.h"

#include <array>
#include <cstring>

namespace axlecast {

void Secret::Wipe() {
  explicit_bzero(text_.data(), text_.size());
  text_.clear();
}

[[gnu::noinline]] void WipeStack() {
  std::array<char, 65'536> left;
  explicit_bzero(left.data(), left.size());
}

}  // namespace axlecast
