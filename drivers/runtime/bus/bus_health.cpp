#include "drivers/runtime/bus/bus_health.h"

#include <algorithm>
#include <axlecast/alarm_entry_t.hpp>
#include <limits>
#include <numeric>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr std::size_t kPortBytes = 120;
constexpr std::size_t kErrorBytes = 160;

std::int64_t Sum(std::span<const std::int64_t> values) {
  return std::accumulate(values.begin(), values.end(), std::int64_t{0});
}

}  // namespace

BusHealth::BusHealth(const BusConfig& config, std::int64_t boot_id, const Timebase& time, MessageSink& sink)
    : time_(time),
      sink_(sink),
      channel_("BUS/" + config.name),
      message_{},
      times_channel_("BUS_TIMES/" + config.name),
      times_{},
      wire_limit_hz_(WireLimit(config)) {
  message_.boot_id = boot_id;
  message_.bus = config.name;
  message_.family = config.family != nullptr ? std::string(config.family->name) : std::string();
  message_.port = CappedText(config.link.port, kPortBytes);
  message_.can_tec = -1;
  message_.can_rec = -1;
  message_.wire_limit_hz = static_cast<float>(wire_limit_hz_);
  previous_ = message_;
  times_.boot_id = boot_id;
  times_.bus = config.name;
  times_.bound_us.assign(ExchangeHistogram::kBoundsUs.begin(), ExchangeHistogram::kBoundsUs.end());
  times_.n = static_cast<std::int8_t>(times_.bound_us.size());
  times_.within.resize(times_.bound_us.size());
}

double BusHealth::WireLimit(const BusConfig& config) {
  MonoNs sum = 0;
  int exchanges = 0;
  for (const DeviceConfig& device : config.devices) {
    if (device.settings == nullptr || device.settings->wire_time <= 0) return 0;
    sum += device.settings->wire_time;
    exchanges += device.settings->exchanges;
  }
  if (sum == 0) return 0;
  return exchanges * static_cast<double>(kSecond) / static_cast<double>(sum);
}

void BusHealth::Publish(MonoNs now, Bus& bus, std::span<const DeviceTally> devices, const CanHealth& can) {
  message_.mono_ns = now;
  message_.utime = time_.Utime(now);
  Count(bus, devices);
  TakeCan(bus, can);
  Rates(now, bus);
  LastError(now, bus, devices, can.trouble);
  if (axlecast::Publish(sink_, channel_, message_)) ++message_.seq;
  PublishTimes(bus);
  previous_ = message_;
  seen_.assign(devices.begin(), devices.end());
  bus.stats().Clear();
  window_start_ = now;
}

void BusHealth::PublishTimes(const Bus& bus) {
  times_.mono_ns = message_.mono_ns;
  times_.utime = message_.utime;
  times_.total = bus.times().total();
  times_.sum_us = bus.times().sum() / kMicrosecond;
  std::ranges::copy(bus.times().Within(), times_.within.begin());
  if (axlecast::Publish(sink_, times_channel_, times_)) ++times_.seq;
}

void BusHealth::Count(const Bus& bus, std::span<const DeviceTally> devices) {
  const Bus::Counters counters = bus.counters();
  message_.exchanges = counters.exchanges;
  message_.late = bus.late();
  message_.reopens = static_cast<std::int32_t>(counters.reopens);
  message_.rx_dropped = counters.line.dropped;
  message_.good = 0;
  std::fill(std::begin(message_.errors), std::end(message_.errors), 0);
  for (const DeviceTally& device : devices) {
    message_.good += device.good;
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) message_.errors[kind] += device.errors[kind];
  }
  // These are seen by the line, not by a device.
  message_.errors[static_cast<std::size_t>(ErrorKind::kFraming)] += counters.line.framing;
  message_.errors[static_cast<std::size_t>(ErrorKind::kIo)] += counters.losses;

  const std::int64_t good = message_.good - previous_.good;
  const std::int64_t failed = Sum(message_.errors) - Sum(previous_.errors);
  if (!bus.up()) {
    message_.state =
        bus.ever_up() || !bus.problem().empty() ? bus_health_t::STATE_DOWN : bus_health_t::STATE_STARTING;
  } else {
    message_.state = failed * 100 > good + failed ? bus_health_t::STATE_DEGRADED : bus_health_t::STATE_UP;
  }
}

void BusHealth::TakeCan(const Bus& bus, const CanHealth& can) {
  constexpr int kMax = std::numeric_limits<std::int16_t>::max();
  message_.can_tec = static_cast<std::int16_t>(std::min(can.tec, kMax));
  message_.can_rec = static_cast<std::int16_t>(std::min(can.rec, kMax));
  const bool worse = can.worst != nullptr && can.worst->severity >= alarm_entry_t::SEVERITY_WARNING;
  if (bus.up() && worse) message_.state = bus_health_t::STATE_DEGRADED;
}

void BusHealth::Rates(MonoNs now, Bus& bus) {
  const MonoNs window = window_start_ > 0 ? now - window_start_ : 0;
  message_.window_us =
      static_cast<std::int32_t>(std::min<MonoNs>(window / kMicrosecond, std::numeric_limits<std::int32_t>::max()));
  const auto exchanges = static_cast<double>(message_.exchanges - previous_.exchanges);
  const double rate = window > 0 ? exchanges * static_cast<double>(kSecond) / static_cast<double>(window) : 0;
  message_.rate_hz = static_cast<float>(rate);
  message_.utilisation = wire_limit_hz_ > 0 ? static_cast<float>(std::min(1.0, rate / wire_limit_hz_)) : 0.0F;
  const ExchangeStats& stats = bus.stats();
  const std::array<MonoNs, 4> figures = {stats.min(), stats.Percentile(0.5), stats.Percentile(0.99), stats.max()};
  for (std::size_t i = 0; i < figures.size(); ++i) {
    message_.exchange_us[i] = stats.count() == 0
                                  ? std::numeric_limits<float>::quiet_NaN()
                                  : static_cast<float>(figures[i]) / static_cast<float>(kMicrosecond);
  }
}

void BusHealth::LastError(MonoNs now, const Bus& bus, std::span<const DeviceTally> devices,
                          std::string_view can_trouble) {
  std::string text;
  std::int64_t maximum = 0;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
      const std::int64_t before = i < seen_.size() ? seen_[i].errors[kind] : 0;
      const std::int64_t more = devices[i].errors[kind] - before;
      if (more <= maximum) continue;
      maximum = more;
      text = std::string(devices[i].device) + ": " + std::to_string(more) + " x " +
             ErrorName(static_cast<ErrorKind>(kind));
    }
  }
  if (!can_trouble.empty()) text = can_trouble;  // what fails there fails for this reason
  if (bus.problem() != seen_problem_) text = seen_problem_ = bus.problem();
  if (text.empty()) return;
  message_.last_error = CappedText(text, kErrorBytes);
  message_.last_error_utime = time_.Utime(now);
}

}  // namespace axlecast
