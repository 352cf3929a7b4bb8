#include "tools/service/error_trend.h"

#include <cmath>
#include <numeric>

namespace axlecast {
namespace {

constexpr std::size_t kMaxBuses = 64;         // limits the memory for a damaged log
constexpr std::size_t kMaxEntries = 24 * 92;  // three months per bus

// Adds the increase since `before`, in the same run of the driver.
void AddDifference(ErrorTrend::Entry& to, const ErrorTrend::Entry& before, const ErrorTrend::Entry& now) {
  const auto add = [](std::int64_t& sum, std::int64_t from, std::int64_t until) {
    sum = std::min(sum + Growth(from, until), kMaxCounts);
  };
  add(to.exchanges, before.exchanges, now.exchanges);
  add(to.reopens, before.reopens, now.reopens);
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind)
    add(to.errors[kind], before.errors[kind], now.errors[kind]);
  to.p99_us = std::max(to.p99_us, now.p99_us);
}

}  // namespace

std::int64_t ErrorTrend::Entry::Failed() const {
  return std::accumulate(errors.begin(), errors.end(), std::int64_t{0});
}

void ErrorTrend::OnBus(const bus_health_t& health) {
  if (buses_.size() >= kMaxBuses && !buses_.contains(health.bus)) return;
  Bus& bus = buses_[health.bus];
  Entry now;
  now.exchanges = health.exchanges;
  now.reopens = health.reopens;
  std::copy(std::begin(health.errors), std::end(health.errors), now.errors.begin());
  now.p99_us = std::isfinite(health.exchange_us[2]) ? health.exchange_us[2] : 0;
  if (bus.seq >= 0 && bus.boot_id == health.boot_id && health.seq <= bus.seq) return;  // repeated or late
  const bool same_life = bus.seq >= 0 && bus.boot_id == health.boot_id;
  const std::int64_t span = health.utime - health.utime % kSpan;
  if (bus.entries.size() >= kMaxEntries && !bus.entries.contains(span)) bus.entries.erase(bus.entries.begin());
  AddDifference(bus.entries[span], same_life ? bus.counted : Entry{}, now);
  bus.port = health.port;
  bus.boot_id = health.boot_id;
  bus.seq = health.seq;
  bus.counted = now;
}

std::string KindsText(const std::array<std::int64_t, kErrorKinds>& errors) {
  std::string text;
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    if (errors[kind] == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(ErrorName(static_cast<ErrorKind>(kind))) + ' ' +
            std::to_string(errors[kind]);
  }
  return text.empty() ? "none" : text;
}

}  // namespace axlecast
