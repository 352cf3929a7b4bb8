#include "core/device/family.h"

namespace axlecast {

const Family* FindFamily(std::string_view name) {
  for (const Family* family : Families()) {
    if (family->name == name) return family;
  }
  return nullptr;
}

}  // namespace axlecast
