#include "bridge/reference_memory.h"

namespace axlecast {

bool ReferenceMemory::OnHello(const std::string& device, std::int64_t driver_boot_id, bool lost) {
  Entry& entry = devices_[device];
  if (lost) {
    entry = {true, driver_boot_id};
    return false;
  }
  if (entry.known_by == driver_boot_id) entry.lost = false;
  return entry.lost;
}

}  // namespace axlecast
