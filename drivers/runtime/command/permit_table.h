#pragma once

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// What the control process allows at present, device by device, from permit_t. It counts when a key of role control
// signed it whose devices hold this one, for those operations that the key's hold as well; unsigned only where the
// machine's file allows it. Thread-safe; no signature is verified while it locks.
class PermitTable {
 public:
  PermitTable(const BusConfig& bus, const BridgeConfig& bridge);

  // The hosts' clocks agree within this.
  static constexpr std::int64_t kClockToleranceUs = 1'000'000;

  // Takes a permit that came on PERMIT/<device> at `now`, which is `utime` (us, UNIX time). Ignores a malformed one,
  // one for another device, one that is valid for less than 1 or more than 500 ms, one that was issued further from
  // `utime` than its validity and the clocks' tolerance explain, one that its issuer has overtaken already, and one
  // of another issuer that was not issued after the last that counted. A clock that is set back makes no old permit
  // young: it is judged by the latest time that this host has had.
  void Accept(std::string_view device, Bytes message, MonoNs now, std::int64_t utime);
  // A fresh permit names the operation, or the device's configuration says `permit: not_required`.
  [[nodiscard]] bool Holds(std::string_view device, std::string_view operation, MonoNs now) const;
  // Why it does not, for a person, with what was measured.
  [[nodiscard]] std::string Why(std::string_view device, std::string_view operation, MonoNs now) const;

 private:
  struct Permit {
    bool required = true;
    bool came = false;  // one that counted
    std::int64_t issuer_boot_id = 0;
    std::int64_t issue = 0;
    std::int64_t issued_utime = 0;
    MonoNs accepted = 0;
    MonoNs until = 0;
    std::set<std::string, std::less<>> operations;
    std::string trouble;  // of the last one that did not count; empty: the last one counted, or none came
    MonoNs trouble_at = 0;
  };
  // Whose it is; null with `trouble`. An unsigned one that counts has the grant of anybody.
  [[nodiscard]] const KeyGrant* GrantOf(const permit_t& envelope, const permit_body_t& body,
                                        std::string& trouble) const;
  // Empty when it counts.
  [[nodiscard]] std::string SetBack(const permit_body_t& body, MonoNs now, std::int64_t utime);
  [[nodiscard]] static std::string Untimely(const Permit& last, const permit_body_t& body, std::int64_t utime);
  void Take(Permit& permit, const permit_body_t& body, const KeyGrant& grant, MonoNs now);

  const BridgeConfig bridge_;
  const KeyGrant anybody_;
  mutable std::mutex mutex_;
  std::map<std::string, Permit, std::less<>> devices_;
  std::int64_t latest_offset_us_ = INT64_MIN;  // greatest UNIX time minus monotonic time so far
};

}  // namespace axlecast
