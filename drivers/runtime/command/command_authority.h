#pragma once

#include <axlecast/driver_command_t.hpp>
#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Keeps orders of the past from acting: those of a bridge boot that was replaced, and those that a newer order of
// any bridge has overtaken, so that a recorded order of a bridge that is long gone does not act either.
class EpochFence {
 public:
  enum class Verdict : std::uint8_t {
    kNewest,  // newer than everything before, of whichever bridge; now the newest
    kOlder,   // overtaken or repeated: only good for an answer, from which a new bridge learns newest()
    kFenced,  // from a bridge that was replaced
  };

  // A boot id never seen before becomes the present bridge with its first order above newest().
  [[nodiscard]] Verdict Judge(std::int64_t bridge_boot_id, std::int64_t bridge_epoch);
  // Newest epoch accepted from any bridge; 0 none.
  [[nodiscard]] std::int64_t newest() const { return newest_; }

 private:
  static constexpr std::size_t kRemembered = 64;  // replaced bridges

  std::int64_t present_ = 0;
  std::int64_t newest_ = 0;
  std::deque<std::int64_t> replaced_;
};

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

// Whose orders a driver obeys: those that the bridge's key signed; where the machine's file names none, all where it
// allows unsigned commands, else none.
class OrderAuthority {
 public:
  explicit OrderAuthority(const BridgeConfig& bridge)
      : key_(bridge.bridge.public_key), allow_unsigned_(bridge.allow_unsigned) {}

  [[nodiscard]] bool Allows(const driver_command_t& envelope) const;
  // For the log: who is obeyed, and what to do where that is nobody.
  [[nodiscard]] std::string_view Rule() const;

 private:
  const std::optional<PublicKey> key_;
  const bool allow_unsigned_;
};

}  // namespace axlecast
