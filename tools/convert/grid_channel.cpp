#include "tools/convert/grid_channel.h"

#include <cmath>
#include <utility>

namespace axlecast {
namespace {

constexpr std::int64_t kNsPerMicrosecond = 1'000;
constexpr std::int64_t kUsualMaxAge = 50'000;                               // us
constexpr std::int64_t kLatestInstant = INT64_MAX / kNsPerMicrosecond / 2;  // us: 2116, far from where ns overflow

std::int64_t MaxAge(std::int64_t wanted, const DeviceByBoot& devices) {
  if (wanted > 0) return wanted;
  for (const auto& [boot_id, device] : devices) {
    if (device.max_age_us > 0) return device.max_age_us;
  }
  return kUsualMaxAge;
}

}  // namespace

GridChannel::GridChannel(std::int64_t period_us, std::int64_t max_age_us, DeviceByBoot devices)
    : period_us_(period_us),
      max_age_us_(MaxAge(max_age_us, devices)),
      devices_(std::move(devices)),
      tracker_({.max_extrapolation_ns = 0, .max_gap_ns = max_age_us_ * kNsPerMicrosecond, .same_host = false}) {}

void GridChannel::On(const position_t& position, const Sink& sink) {
  const std::int64_t at = position.utime;
  if (at < 0 || at > kLatestInstant) return;
  const PositionTracker::News news = tracker_.OnPosition(position, at * kNsPerMicrosecond);
  if (!before_ || news.restarted) {
    before_.reset();
    const auto device = devices_.find(position.boot_id);
    if (device != devices_.end()) tracker_.OnDevice(device->second);
  }
  if (!news.used) return;
  if (before_) {
    std::int64_t index = before_->utime / period_us_ + 1;
    for (; index * period_us_ < at && index * period_us_ - before_->utime <= max_age_us_; ++index) {
      sink(index, At(index * period_us_, before_->flags));
    }
  }
  if (at % period_us_ == 0) sink(at / period_us_, At(at, position.flags));
  before_ = position;
}

GridChannel::Cell GridChannel::At(std::int64_t utime, std::int32_t flags) const {
  const PositionTracker::Position position = tracker_.At(utime * kNsPerMicrosecond);
  Cell cell{.value = {}, .counts = {}, .flags = flags};
  if (!position) return cell;
  cell.counts = position.counts;
  if (!std::isnan(position.value)) cell.value = position.value;
  return cell;
}

}  // namespace axlecast
