#include "core/base/secret.h"

#include <cstring>

namespace axlecast {

void Secret::Wipe() {
  explicit_bzero(text_.data(), text_.size());
  text_.clear();
}

}  // namespace axlecast
