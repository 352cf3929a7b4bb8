#include "drivers/tformat/reset_counter.h"

namespace axlecast::tformat {

bool ResetCounter::OnReset(std::uint8_t id, MonoNs now) {
  if (count_ > 0 && id != id_) Break();
  if (count_ > 0 && now - last_ < kInterval) {
    ++too_early_;
    Break();
    return false;
  }
  id_ = id;
  last_ = now;
  if (++count_ < kTimes) return false;
  count_ = 0;
  return true;
}

void ResetCounter::Break() {
  if (count_ > 0) ++broken_;
  count_ = 0;
}

}  // namespace axlecast::tformat
