#include "client/command/permit_slot.h"

#include "client/axlecast/permit_issuer.h"
#include "client/command/signed_messages.h"

namespace axlecast {
namespace {

bool Renews(const PermitRequest& request, const PermitRequest& sent) {
  return request.valid_ms == sent.valid_ms && request.operations == sent.operations;
}

MonoNs Pace(const PermitRequest& request) { return request.valid_ms * kMillisecond / 4; }

}  // namespace

std::int32_t RemainingMs(const PermitRequest& request, MonoNs now) {
  const MonoNs ends = request.called.mono + request.valid_ms * kMillisecond;
  return now >= ends ? 0 : static_cast<std::int32_t>((ends - now + kMillisecond - 1) / kMillisecond);
}

PermitSlot::Asked PermitSlot::Allow(const std::vector<std::string>& operations, std::int32_t valid_ms,
                                    const PermitInstant& now, std::atomic<std::int64_t>& issue) {
  const std::lock_guard lock(callers_);
  const bool changed = !allows_ || valid_ms != valid_ms_ || operations != operations_;
  if (changed) {
    if (!FitsPermit(device_, operations)) return Asked::kRefused;
    operations_ = operations;
    valid_ms_ = valid_ms;
    allows_ = true;
  }
  PermitRequest& request = requests_.back();
  request.operations = operations;
  request.valid_ms = valid_ms;
  request.issue = ++issue;
  request.called = now;
  requests_.Publish();
  const bool watched = watched_.exchange(true);
  return changed || !watched ? Asked::kWake : Asked::kStored;
}

std::optional<PermitRequest> PermitSlot::Withdraw(const PermitInstant& now, std::atomic<std::int64_t>& issue) {
  const std::lock_guard lock(callers_);
  if (!allows_) return std::nullopt;
  allows_ = false;
  PermitRequest request;
  request.valid_ms = PermitIssuer::kMaxValidMs;
  request.issue = ++issue;
  request.called = now;
  withdrawn_ = request.issue;
  return request;
}

PermitSlot::Step PermitSlot::Next(MonoNs now) {
  if (requests_.Take()) unsent_ = true;
  const PermitRequest& newest = requests_.front();
  unsent_ = unsent_ && !IsWithdrawn(newest);
  if (unsent_ && (now >= due_ || IsWithdrawn(sent_) || !Renews(newest, sent_))) {
    unsent_ = false;
    sent_ = newest;
    due_ = now + Pace(newest);
    return {&newest, due_};
  }
  if (unsent_ || now < due_) return {nullptr, due_};
  watched_ = false;
  if (!requests_.fresh()) return {};
  watched_ = true;
  return {nullptr, now};
}

}  // namespace axlecast
