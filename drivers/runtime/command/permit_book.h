#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/inline_bytes.h"
#include "drivers/runtime/core/instant.h"

namespace axlecast {

// What the control process allows at present, device by device, from permit_t.
// Signatures are not verified yet: see docs/commands.md.
class PermitBook {
 public:
  explicit PermitBook(const BusConfig& bus);

  // Takes a permit that came on PERMIT/<device> at `now`. Ignores a malformed one, one for another device, one that
  // is valid for less than 1 or more than 500 ms, and one that its issuer has overtaken already.
  void Accept(std::string_view device, Bytes message, MonoNs now);
  // A fresh permit names the operation, or the device's configuration says `permit: not_required`.
  [[nodiscard]] bool Holds(std::string_view device, std::string_view operation, MonoNs now) const;

 private:
  struct Permit {
    bool required = true;
    std::int64_t issuer_boot_id = 0;
    std::int64_t issue = 0;
    MonoNs until = 0;
    std::set<std::string, std::less<>> operations;
  };
  std::map<std::string, Permit, std::less<>> devices_;
};

}  // namespace axlecast
