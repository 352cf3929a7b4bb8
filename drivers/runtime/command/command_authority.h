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
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Prevents old commands from acting: commands of a bridge boot that was replaced, and commands that are older than the
// newest command of any bridge. A recorded command of an earlier bridge therefore does not act either.
class EpochFence {
 public:
  enum class Verdict : std::uint8_t {
    kNewest,  // newer than every earlier command of any bridge
    kOlder,   // older or repeated: it is only answered; from the answer, a new bridge learns newest()
    kFenced,  // from a bridge that was replaced
  };

  // A new boot id becomes the present bridge with its first command above newest().
  [[nodiscard]] Verdict Check(std::int64_t bridge_boot_id, std::int64_t bridge_epoch);
  // Returns the newest epoch accepted from any bridge; 0: no epoch was accepted.
  [[nodiscard]] std::int64_t newest() const { return newest_; }

 private:
  static constexpr std::size_t kMaxReplaced = 64;

  std::int64_t present_ = 0;
  std::int64_t newest_ = 0;
  std::deque<std::int64_t> replaced_;
};

// The operations that the control process permits at present, for each device, from permit_t. A permit is accepted if a key
// of role control signed it that is valid for the device; it permits the operations for which the key is valid, too. An
// unsigned permit is accepted only if the machine's file allows it. Thread-safe; no signature is verified while locked.
class PermitTable {
 public:
  PermitTable(const BusConfig& bus, const BridgeConfig& bridge);

  // The largest difference of the hosts' clocks.
  static constexpr std::int64_t kClockToleranceUs = 1'000'000;

  // Takes a permit that came on PERMIT/<device> at `now`, which is `unix_us` in UNIX time. It ignores permits that are
  // - malformed, for another device, or valid for less than 1 or more than 500 ms;
  // - issued at a time that their validity and the tolerance of the clocks do not explain;
  // - not newer than the last permit of their issuer, or of another issuer.
  // If this host's clock is set back, the age of a permit is measured from the latest time that the host has had.
  void Accept(std::string_view device, Bytes message, MonoNs now, std::int64_t unix_us);
  // Succeeds if a fresh permit names the operation, or the configuration of the device has `permit: not_required`. The
  // error states for an operator what is missing, with the measured times.
  [[nodiscard]] Result<> Check(std::string_view device, std::string_view operation, MonoNs now) const;

 private:
  struct Permit {
    bool required = true;
    bool came = false;  // a permit was accepted
    std::int64_t issuer_boot_id = 0;
    std::int64_t issue = 0;
    std::int64_t issued_utime = 0;
    MonoNs accepted = 0;
    MonoNs until = 0;
    std::set<std::string, std::less<>> operations;
    std::string rejection;  // why the last one was rejected; empty: it was accepted, or none came
    MonoNs rejected_at = 0;
  };
  // Returns the grant of the key that signed the permit. An accepted unsigned permit has the grant of anybody.
  [[nodiscard]] Result<const KeyGrant*> GrantOf(const permit_t& envelope, const permit_body_t& body) const;
  // Rejects a permit that looks fresh only because this host's clock was set back.
  [[nodiscard]] Result<> CheckClock(const permit_body_t& body, MonoNs now, std::int64_t unix_us);
  [[nodiscard]] static Result<> CheckTime(const Permit& last, const permit_body_t& body, std::int64_t unix_us);
  void Take(Permit& permit, const permit_body_t& body, const KeyGrant& grant, MonoNs now);

  const BridgeConfig bridge_;
  const KeyGrant anybody_;
  mutable std::mutex mutex_;
  std::map<std::string, Permit, std::less<>> devices_;
  std::int64_t latest_offset_us_ = INT64_MIN;  // greatest UNIX time minus monotonic time so far
};

// Decides which commands a driver executes: those signed by the bridge's key. If the machine's file names no key, all
// commands if it allows unsigned commands, and otherwise no command.
class CommandAuthority {
 public:
  explicit CommandAuthority(const BridgeConfig& bridge)
      : key_(bridge.bridge.public_key), allow_unsigned_(bridge.allow_unsigned) {}

  [[nodiscard]] bool Allows(const driver_command_t& envelope) const;
  // Returns for the log which commands are executed, and what to do if no command is.
  [[nodiscard]] std::string_view Rule() const;

 private:
  const std::optional<PublicKey> key_;
  const bool allow_unsigned_;
};

}  // namespace axlecast
