#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace axlecast {

// Which devices have lost their reference, across restarts of their drivers: a driver keeps nothing on disk.
// Lasts as long as the bridge; the drivers' HELLO fills it again after a restart of the bridge.
class ReferenceMemory {
 public:
  // What the HELLO of a driver's boot says. True when that boot must be told that the reference is lost: it was,
  // and nothing has restored it since.
  [[nodiscard]] bool OnHello(const std::string& device, std::int64_t driver_boot_id, bool lost);

 private:
  struct Entry {
    bool lost = false;
    std::int64_t known_by = 0;  // the newest boot that has said so itself: only it can tell that it was restored
  };
  std::map<std::string, Entry> devices_;
};

}  // namespace axlecast
