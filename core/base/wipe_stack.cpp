#include "core/base/wipe_stack.h"

#include <array>
#include <cstring>

namespace axlecast {

[[gnu::noinline]] void WipeStack() {
  std::array<char, 65'536> left;
  explicit_bzero(left.data(), left.size());
}

}  // namespace axlecast
