#include "drivers/runtime/command/command_authority.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstdio>

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
// Larger differences of two times are limited to this.
constexpr std::int64_t kFarUs = INT64_C(4'000'000'000'000'000'000);

std::string Seconds(double seconds) {
  std::array<char, 32> text{};
  static_cast<void>(std::snprintf(text.data(), text.size(), "%.3g s", seconds));
  return text.data();
}

std::string Seconds(MonoNs time) { return Seconds(static_cast<double>(time) / kSecond); }

bool Contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

PermitTable::PermitTable(const BusConfig& bus, const BridgeConfig& bridge) : bridge_(bridge) {
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

Result<> PermitTable::CheckTime(const Permit& last, const permit_body_t& body, std::int64_t unix_us) {
  // Positive: issued in the past.
  const std::int64_t age = unix_us - std::clamp(body.issued_utime, -kFarUs, kFarUs);
  if (age < -kClockToleranceUs || age > body.valid_ms * INT64_C(1'000) + kClockToleranceUs) {
    return Failure("was issued " + Seconds(static_cast<double>(std::abs(age)) / 1e6) +
                   (age > 0 ? " ago" : " from now") +
                   ": old, or the clocks of the two computers differ by that: see NTP or PTP");
  }
  if (!last.came) return {};
  if (body.issuer_boot_id == last.issuer_boot_id) {
    if (body.issue > last.issue) return {};
    return Failure("was a repetition: issue must increase");
  }
  if (body.issued_utime > last.issued_utime) return {};
  return Failure("was issued " + Seconds(static_cast<double>(last.issued_utime - body.issued_utime) / 1e6) +
                 " before the last one of another control process");
}

Result<> PermitTable::CheckClock(const permit_body_t& body, MonoNs now, std::int64_t unix_us) {
  const std::int64_t mono_us = now / kMicrosecond;
  latest_offset_us_ = std::max(latest_offset_us_, unix_us - mono_us);
  const std::int64_t latest = latest_offset_us_ + mono_us;
  const std::int64_t age = latest - std::clamp(body.issued_utime, -kFarUs, kFarUs);
  if (age <= body.valid_ms * INT64_C(1'000) + kClockToleranceUs || latest - unix_us <= kClockToleranceUs) return {};
  return Failure("was issued " + Seconds(static_cast<double>(age) / 1e6) +
                 " ago, before this computer's clock was set back by " +
                 Seconds(static_cast<double>(latest - unix_us) / 1e6) +
                 ": when the clock is right, start the driver again");
}

void PermitTable::Take(Permit& permit, const permit_body_t& body, const KeyGrant& grant, MonoNs now) {
  permit.came = true;
  permit.issuer_boot_id = body.issuer_boot_id;
  permit.issue = body.issue;
  permit.issued_utime = body.issued_utime;
  permit.accepted = now;
  permit.until = now + body.valid_ms * kMillisecond;
  permit.rejection.clear();
  permit.operations.clear();
  for (const std::string& operation : body.operations) {
    if (grant.operations.empty() || Contains(grant.operations, operation)) permit.operations.insert(operation);
  }
}

void PermitTable::Accept(std::string_view device, Bytes message, MonoNs now, std::int64_t unix_us) {
  const auto envelope = DecodeMessage<permit_t>(message);
  if (!envelope) return;
  const auto body = DecodeMessage<permit_body_t>(envelope->permit);
  if (!body || body->device != device || body->n_operations > kMaxOperations) return;
  if (body->valid_ms < 1 || body->valid_ms > kMaxValidMs) return;
  const Result<const KeyGrant*> grant = GrantOf(*envelope, *body);

  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(device);
  if (found == devices_.end()) return;
  Permit& permit = found->second;
  const Result<> accepted =
      grant.and_then([&](const KeyGrant*) { return CheckClock(*body, now, unix_us); }).and_then([&] {
        return CheckTime(permit, *body, unix_us);
      });
  if (accepted) return Take(permit, *body, **grant, now);
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
