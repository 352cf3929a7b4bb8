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
#include "core/time/base_claim.h"

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
  // `clock_id`: of this host, 0: not known. `base`: the host's place on the time base, must outlive the table; null: not known.
  PermitTable(const BusConfig& bus, const BridgeConfig& bridge, std::int64_t clock_id = 0,
              const BaseClaims* base = nullptr);

  // A permit may be this much older than its validity, or younger than 0.
  static constexpr MonoNs kTolerance = kSecond;

  // Takes a permit that came on PERMIT/<device> at `now`, which is `unix_us` in UNIX time. It ignores permits that are
  // - malformed, for another device, or valid for less than 1 or more than 500 ms;
  // - not proven to be at most valid_ms + kTolerance old, and at least -kTolerance;
  // - not newer than the last permit of their issuer, or of another issuer.
  // Ages are measured by CLOCK_MONOTONIC if the issuer runs on this host, else by the time base if issuer and driver have a claim
  // on it, with both half widths, else by UNIX time. If UNIX time is set back, such an age is measured from the latest UNIX time
  // that the host has had.
  void Accept(std::string_view device, Bytes message, MonoNs now, std::int64_t unix_us);
  // Succeeds if a fresh permit names the operation, or the configuration of the device has `permit: not_required`. The
  // error states for an operator what is missing, with the measured times.
  [[nodiscard]] Result<> Check(std::string_view device, std::string_view operation, MonoNs now) const;

 private:
  struct Permit {
    bool required = true;
    bool came = false;     // a permit was accepted
    permit_body_t last{};  // the accepted permit
    MonoNs until = 0;
    std::set<std::string, std::less<>> operations;
    std::string rejection;  // why the last one was rejected; empty: it was accepted, or none came
    MonoNs rejected_at = 0;
  };
  // Returns the grant of the key that signed the permit. An accepted unsigned permit has the grant of anybody.
  [[nodiscard]] Result<const KeyGrant*> GrantOf(const permit_t& envelope, const permit_body_t& body) const;
  // A time between two instants, within ns +- half_width_ns, and the clock that measured it.
  enum class Measure : std::uint8_t { kSameClock, kTimeBase, kUnixTime };
  struct Span {
    Measure by = Measure::kUnixTime;
    MonoNs ns = 0;
    MonoNs half_width_ns = 0;
  };
  [[nodiscard]] static Span Between(const permit_body_t& earlier, const permit_body_t& later);
  // Returns this instant as a permit that is issued now would state it. `base_id`: the base that matters, 0: none.
  [[nodiscard]] permit_body_t Present(std::int64_t base_id, MonoNs now, std::int64_t unix_us) const;
  [[nodiscard]] static std::string Text(const Span& span);
  // Rejects a permit that looks fresh only because this host's UNIX time was set back.
  [[nodiscard]] Result<> CheckSetBack(const permit_body_t& body, const Span& age, MonoNs now, std::int64_t unix_us);
  [[nodiscard]] static Result<> CheckAge(const permit_body_t& body, const Span& age);
  [[nodiscard]] static Result<> CheckOrder(const Permit& permit, const permit_body_t& body);
  static void Take(Permit& permit, permit_body_t body, const KeyGrant& grant, MonoNs now);

  const BridgeConfig bridge_;
  const KeyGrant anybody_;
  const std::int64_t clock_id_;
  const BaseClaims* const base_;
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
