#include "tests/simulation/consumer.h"

#include <cstdlib>
#include <utility>

#include "core/base/text.h"

namespace axlecast::simulation {
namespace {

constexpr MonoNs kConversion = 8;                    // ns: how exactly the simulation converts its own instants
constexpr MonoNs kMaxHalfWidth = 20 * kMillisecond;  // of a reading of another host
constexpr double kClockRates = 1.002;                // an age is measured by the clock of the host

}  // namespace

Consumer::Consumer(Schedule& schedule, Host& host, const Host& root, Network& network, Promises& promises,
                   HostOf host_of, LastValid last_valid)
    : schedule_(schedule),
      host_(host),
      root_(root),
      promises_(promises),
      host_of_(std::move(host_of)),
      last_valid_(std::move(last_valid)) {
  network.Join(host, Port::kData,
               [this](const std::string& channel, Bytes message) { OnMessage(channel, message); });
  Cycle();
}

void Consumer::OnMessage(const std::string& channel, Bytes message) {
  const MonoNs now = host_.clock.Now();
  if (channel.starts_with("TIME/")) {
    if (const auto time = DecodeMessage<time_quality_t>(message)) time_.OnTime(*time, now);
  }
  if (channel.starts_with("DEVICE/")) {
    const auto info = DecodeMessage<device_info_t>(message);
    if (!info) return;
    max_age_us_[info->device] = info->max_age_us;
    const auto tracker = trackers_.find(info->device);
    if (tracker != trackers_.end()) tracker->second.OnDevice(*info);
  }
  if (channel.starts_with("POSITION/")) {
    if (const auto position = DecodeMessage<position_t>(message)) OnPosition(channel.substr(9), *position);
  }
}

void Consumer::OnPosition(const std::string& device, const position_t& position) {
  const MonoNs now = host_.clock.Now();
  auto tracker = trackers_.find(device);
  if (tracker == trackers_.end()) {
    PositionTracker::Options options;
    options.clock_id = host_.clock_id();
    options.time = &time_;
    options.max_time_half_width_ns = kMaxHalfWidth;
    tracker = trackers_.emplace(device, PositionTracker(options)).first;
  }
  static_cast<void>(tracker->second.OnPosition(position, now));
  const Host* of = host_of_(position.clock_id);
  const TimeBase::Instant instant = time_.OnBase(position.clock_id, position.mono_ns, now);
  promises_.Count("instants asked for on the time base");
  if (!instant || of == nullptr) return;
  promises_.Count("instants compared on the time base");
  const MonoNs truth = root_.clock.RawAt(of->clock.TimeOf(position.mono_ns));
  const MonoNs off = std::abs(truth - instant.ns) - instant.half_width_ns;
  if (off > kConversion)
    promises_.Breach(Text("%s: the instant of a reading misses the truth on the time base by %lld ns",
                          device.c_str(), static_cast<long long>(off)));
}

void Consumer::Cycle() {
  for (const auto& [device, tracker] : trackers_) {
    const auto max_age = max_age_us_.find(device);
    if (max_age == max_age_us_.end()) continue;
    if (tracker.Check(host_.clock.Now()) != PositionTracker::Freshness::kFresh) continue;
    promises_.Count("axes that are fresh");
    const auto most =
        static_cast<MonoNs>(static_cast<double>(max_age->second * kMicrosecond) * kClockRates) + kMaxHalfWidth;
    // A reading is older than its message.
    if (schedule_.now() - last_valid_(device) > most)
      promises_.Breach(device + ": an axis without a reading is called fresh");
  }
  schedule_.After(kCycle, [this] { Cycle(); });
}

}  // namespace axlecast::simulation
