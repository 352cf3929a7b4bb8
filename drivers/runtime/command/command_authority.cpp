#include "drivers/runtime/command/command_authority.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "core/command/keys.h"
#include "core/messages/message.h"

namespace axlecast {

EpochFence::Verdict EpochFence::Check(std::int64_t bridge_boot_id, std::int64_t bridge_epoch) {
  if (bridge_boot_id != present_) {
    if (std::find(replaced_.begin(), replaced_.end(), bridge_boot_id) != replaced_.end()) return Verdict::kFenced;
    if (bridge_epoch <= newest_) return Verdict::kOlder;
    if (present_ != 0) replaced_.push_back(present_);
    if (replaced_.size() > kMaxReplaced) replaced_.pop_front();
    present_ = bridge_boot_id;
  }
  if (bridge_epoch <= newest_) return Verdict::kOlder;
  newest_ = bridge_epoch;
  return Verdict::kNewest;
}

namespace {

constexpr std::int32_t kMaxValidMs = 500;
constexpr std::int8_t kMaxOperations = 24;

// Sums and differences of times that are limited so do not overflow.
MonoNs Limited(std::int64_t ns) {
  constexpr std::int64_t kFar = INT64_MAX / 8;  // 36 years
  return std::clamp(ns, -kFar, kFar);
}

// Microseconds of UNIX time: the difference of two, in ns.
MonoNs UnixDifference(std::int64_t later_us, std::int64_t earlier_us) {
  constexpr std::int64_t kFarUs = INT64_MAX / 4;
  constexpr std::int64_t kFarNs = INT64_MAX / 8 / kMicrosecond;
  return std::clamp(std::clamp(later_us, -kFarUs, kFarUs) - std::clamp(earlier_us, -kFarUs, kFarUs), -kFarNs,
                    kFarNs) *
         kMicrosecond;
}

std::string Seconds(double seconds) {
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), seconds < 1'000 ? "%.3g s" : "%.0f s", seconds));
  return text.data();
}

std::string Seconds(MonoNs time) { return Seconds(static_cast<double>(time) / kSecond); }

bool Contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

PermitTable::PermitTable(const BusConfig& bus, const BridgeConfig& bridge, std::int64_t clock_id,
                         const BaseClaims* base)
    : bridge_(bridge), clock_id_(clock_id), base_(base) {
  for (const DeviceConfig& device : bus.devices) devices_[device.name].required = device.permit_required;
}

Result<const KeyGrant*> PermitTable::GrantOf(const permit_t& envelope, const permit_body_t& body) const {
  if (body.key_id == 0) {
    if (bridge_.allow_unsigned) return &anybody_;
    return Failure("was unsigned: let the control process sign it with a key of role control");
  }
  const KeyGrant* grant = bridge_.FindKey(body.key_id);
  if (grant == nullptr) {
    return Failure("was signed with a key that the machine's file does not name under bridge.keys");
  }
  if (grant->role != Role::kControl) return Failure("was signed by " + grant->name + ", whose role is not control");
  if (!Verify(grant->key, Domain::kPermit, envelope.permit, SignatureOf(envelope))) {
    return Failure("has a wrong signature: it is not of the key " + grant->name);
  }
  if (!grant->devices.empty() && !Contains(grant->devices, body.device)) {
    return Failure("was signed by " + grant->name + ", whose key is not valid for this device");
  }
  return grant;
}

PermitTable::Span PermitTable::Between(const permit_body_t& earlier, const permit_body_t& later) {
  if (later.clock_id != 0 && later.clock_id == earlier.clock_id) {
    return {Measure::kSameClock, Limited(later.issued_mono_ns) - Limited(earlier.issued_mono_ns), 0};
  }
  if (later.base_id != 0 && later.base_id == earlier.base_id && later.issued_half_width_ns >= 0 &&
      earlier.issued_half_width_ns >= 0) {
    return {Measure::kTimeBase, Limited(later.issued_base_ns) - Limited(earlier.issued_base_ns),
            Limited(later.issued_half_width_ns) + Limited(earlier.issued_half_width_ns)};
  }
  return {Measure::kUnixTime, UnixDifference(later.issued_utime, earlier.issued_utime), 0};
}

permit_body_t PermitTable::Present(std::int64_t base_id, MonoNs now, std::int64_t unix_us) const {
  permit_body_t present{};
  present.clock_id = clock_id_;
  present.issued_mono_ns = now;
  present.issued_utime = unix_us;
  if (base_ == nullptr || base_id == 0) return present;
  if (const std::optional<BaseClaim> own = base_->At(now)) {
    present.base_id = own->base_id;
    present.issued_base_ns = own->base_ns;
    present.issued_half_width_ns = own->half_width_ns;
  }
  return present;
}

std::string PermitTable::Text(const Span& span) {
  std::string text = Seconds(std::abs(span.ns));
  if (span.by == Measure::kTimeBase) text += " +- " + Seconds(span.half_width_ns);
  return text;
}

// A positive age: issued in the past.
Result<> PermitTable::CheckAge(const permit_body_t& body, const Span& age) {
  const MonoNs oldest = body.valid_ms * kMillisecond + kTolerance;
  if (age.ns - age.half_width_ns >= -kTolerance && age.ns + age.half_width_ns <= oldest) return {};
  const std::string when = "was issued " + Text(age) + (age.ns > 0 ? " ago" : " from now");
  switch (age.by) {
    case Measure::kSameClock:
      return Failure(when + " by CLOCK_MONOTONIC of this computer: it is not of now");
    case Measure::kTimeBase:
      return Failure(when + " by the time base: it is not proven to be of now");
    case Measure::kUnixTime:
      break;
  }
  return Failure(
      when +
      " by UNIX time: old, or the clocks of the two computers differ by that: see NTP or PTP, or give the "
      "control process the time base");
}

Result<> PermitTable::CheckOrder(const Permit& permit, const permit_body_t& body) {
  if (!permit.came) return {};
  if (body.issuer_boot_id == permit.last.issuer_boot_id) {
    if (body.issue > permit.last.issue) return {};
    return Failure("was a repetition: issue must increase");
  }
  const Span since = Between(permit.last, body);
  if (since.ns - since.half_width_ns > 0) return {};
  constexpr std::array<const char*, 3> kClocks = {"CLOCK_MONOTONIC of their computer", "the time base",
                                                  "UNIX time"};
  return Failure("was issued " + Text(since) + (since.ns > 0 ? " after" : " before") +
                 " the last one of another control process, by " + kClocks[static_cast<std::size_t>(since.by)] +
                 ": it must be later");
}

Result<> PermitTable::CheckSetBack(const permit_body_t& body, const Span& age, MonoNs now, std::int64_t unix_us) {
  const std::int64_t mono_us = now / kMicrosecond;
  latest_offset_us_ = std::max(latest_offset_us_, unix_us - mono_us);
  if (age.by != Measure::kUnixTime) return {};
  const std::int64_t latest = latest_offset_us_ + mono_us;
  const MonoNs oldest = UnixDifference(latest, body.issued_utime);
  const MonoNs set_back = UnixDifference(latest, unix_us);
  if (oldest <= body.valid_ms * kMillisecond + kTolerance || set_back <= kTolerance) return {};
  return Failure("was issued " + Seconds(oldest) + " ago, before this computer's clock was set back by " +
                 Seconds(set_back) + ": when the clock is right, start the driver again");
}

void PermitTable::Take(Permit& permit, permit_body_t body, const KeyGrant& grant, MonoNs now) {
  permit.came = true;
  permit.until = now + body.valid_ms * kMillisecond;
  permit.rejection.clear();
  permit.operations.clear();
  for (const std::string& operation : body.operations) {
    if (grant.operations.empty() || Contains(grant.operations, operation)) permit.operations.insert(operation);
  }
  permit.last = std::move(body);
}

void PermitTable::Accept(std::string_view device, Bytes message, MonoNs now, std::int64_t unix_us) {
  const auto envelope = DecodeMessage<permit_t>(message);
  if (!envelope) return;
  auto body = DecodeMessage<permit_body_t>(envelope->permit);
  if (!body || body->device != device || body->n_operations > kMaxOperations) return;
  if (body->valid_ms < 1 || body->valid_ms > kMaxValidMs) return;
  const Result<const KeyGrant*> grant = GrantOf(*envelope, *body);
  const Span age = Between(*body, Present(body->base_id, now, unix_us));

  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(device);
  if (found == devices_.end()) return;
  Permit& permit = found->second;
  const Result<> accepted = grant.and_then([&](const KeyGrant*) { return CheckSetBack(*body, age, now, unix_us); })
                                .and_then([&] { return CheckAge(*body, age); })
                                .and_then([&] { return CheckOrder(permit, *body); });
  if (accepted) return Take(permit, std::move(*body), **grant, now);
  permit.rejection = accepted.error().text;
  permit.rejected_at = now;
}

Result<> PermitTable::Check(std::string_view device, std::string_view operation, MonoNs now) const {
  const auto missing = [](std::string why) { return Failure(std::move(why), command_status_t::REASON_NO_PERMIT); };
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(device);
  if (found == devices_.end()) return missing("there is no such device");
  const Permit& permit = found->second;
  if (!permit.required || (now < permit.until && permit.operations.contains(operation))) return {};
  const std::string channel = "PERMIT/" + std::string(device);
  if (now < permit.until) {
    return missing("the present " + channel + " does not allow " + std::string(operation) +
                   ": the control process names other operations, or its key may not permit it");
  }
  if (!permit.rejection.empty()) {
    return missing("the last " + channel + ", " + Seconds(now - permit.rejected_at) + " ago, " + permit.rejection);
  }
  if (!permit.came) {
    return missing("no " + channel +
                   " came from the control process; or set `permit: not_required` for this device");
  }
  return missing("the last " + channel + " ended " + Seconds(now - permit.until) +
                 " ago: the control process allows nothing, or has stopped");
}

bool CommandAuthority::Allows(const driver_command_t& envelope) const {
  if (!key_) return allow_unsigned_;
  return Verify(*key_, Domain::kOrder, envelope.order, SignatureOf(envelope));
}

std::string_view CommandAuthority::Rule() const {
  if (key_) return "only commands that are signed by bridge.key of the machine's file are executed";
  if (allow_unsigned_) return "unsigned commands of any sender are executed: bridge.unsigned_commands is allow";
  return "no command is executed: set bridge.key in the machine's file, or bridge.unsigned_commands: allow";
}

}  // namespace axlecast
