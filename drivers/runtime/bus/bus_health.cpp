#include "drivers/runtime/bus/bus_health.h"

#include <algorithm>
#include <axlecast/alarm_entry_t.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/text.h"

namespace axlecast {
namespace {

using State = CanController::State;

constexpr const char* kWiring = "wiring, termination (120 ohm at both ends)";

// Returns the increase of a count that may have restarted.
std::int64_t More(std::int64_t now, std::int64_t before) { return now >= before ? now - before : now; }

constexpr std::size_t kPortBytes = 120;
constexpr std::size_t kErrorBytes = 160;

std::int64_t Sum(std::span<const std::int64_t> values) {
  return std::accumulate(values.begin(), values.end(), std::int64_t{0});
}

}  // namespace

void CanWatch::Update(const CanController& controller, MonoNs now) {
  const CanController before = std::exchange(controller_, controller);
  now_ = now;
  CountErrors(More(controller.bus_errors, before.bus_errors));
  Raise(kBusOff, controller.state == State::kBusOff || More(controller.bus_offs, before.bus_offs) > 0);
  Raise(kUnacknowledged, More(controller.unacknowledged, before.unacknowledged) > 0 || NobodyAnswers(before));
  Raise(kQueueFull, More(controller.queue_full, before.queue_full) > 0);
  Raise(kErrorPassive, controller.state == State::kPassive);
  Raise(kErrorWarning, controller.state == State::kWarning);
  Raise(kFramesLost,
        More(controller.dropped, before.dropped) > 0 || More(controller.overruns, before.overruns) > 0);

  bool changed = controller.state != before.state;
  for (std::size_t i = 0; i < kKinds; ++i) {
    const bool present = Present(static_cast<Kind>(i));
    changed = changed || present != alarms_[i].present;
    alarms_[i].present = present;
  }
  if (changed) ++revision_;
  Explain();
}

bool CanWatch::Present(Kind kind) const {
  if (!Held(kind)) return false;
  const bool state = kind == kErrorPassive || kind == kErrorWarning;
  if (state && (Held(kBusOff) || Held(kUnacknowledged))) return false;
  return kind != kErrorWarning || !Held(kErrorPassive);
}

// A transmitter that is error-passive and misses nothing but the acknowledge counts no further (ISO 11898-1, fault
// confinement, exception 1): from whatever it had below 128, its counter came to 128..135 in steps of 8, and stays.
bool CanWatch::NobodyAnswers(const CanController& before) const {
  return controller_.state == State::kPassive && controller_.pending > 0 && controller_.tec >= 128 &&
         controller_.tec <= 135 && before.state == State::kPassive && before.tec == controller_.tec;
}

void CanWatch::CountErrors(std::int64_t more) {
  error_total_ += more;
  const ErrorCount oldest = errors_[snapshots_ < kSnapshots ? 0 : snapshots_ % kSnapshots];
  if (snapshots_ > 0 && now_ > oldest.at) {
    const std::int64_t recent = error_total_ - oldest.total;
    // In less than a second, the count itself is the rate.
    const double seconds = std::max(static_cast<double>(now_ - oldest.at) / static_cast<double>(kSecond), 1.0);
    const auto rate = static_cast<std::int64_t>(static_cast<double>(recent) / seconds);
    if (rate >= kManyErrors) {
      errors_per_second_ = rate;
      Raise(kBusErrors, true);
    }
  }
  errors_[snapshots_ % kSnapshots] = {now_, error_total_};
  ++snapshots_;
}

void CanWatch::Explain() {
  const auto worst = std::find_if(alarms_.begin(), alarms_.end(), [](const Alarm& alarm) { return alarm.present; });
  worst_ = worst != alarms_.end() ? worst->spec : nullptr;
  if (worst_ == nullptr) return trouble_.clear();
  trouble_ = interface_ + ": " + Cause(static_cast<Kind>(worst - alarms_.begin()));
}

std::string CanWatch::Cause(Kind kind) const {
  switch (kind) {
    case kBusOff:
      return BusOffText();
    case kUnacknowledged:
      return UnacknowledgedText();
    case kQueueFull:
      return "send queue full: check that the bus is alive; if it is just busy, as root: ip link set " +
             interface_ + " txqueuelen 100";
    case kBusErrors:
      return std::to_string(errors_per_second_) + " bus errors a second: check bit rate" + Rate() + ", " + kWiring;
    case kErrorPassive:
      return StateText(State::kPassive, "error-passive");
    case kFramesLost:
      return LostText();
    case kErrorWarning:
    case kKinds:
      break;
  }
  return StateText(State::kWarning, "error-warning");
}

std::string CanWatch::Rate() const {
  const std::int64_t rate = controller_.bitrate > 0 ? controller_.bitrate : bitrate_;
  return rate > 0 ? " (" + std::to_string(rate) + " bit/s)" : "";
}

std::string CanWatch::BusOffText() const {
  const std::string check = "check bit rate" + Rate() + ", wiring";
  if (controller_.state != State::kBusOff) {
    return "was bus-off, " + std::to_string(controller_.bus_offs) + " times since it was opened; " + check +
           ", termination";
  }
  if (controller_.restart_ms > 0) {
    return "bus-off, restarts by itself " + std::to_string(controller_.restart_ms) + " ms later; " + check +
           ", termination";
  }
  return "bus-off, and stays so; " + check + "; then as root: " + CanRestartLine(interface_);
}

std::string CanWatch::UnacknowledgedText() const {
  std::string text = "nobody acknowledges: check cable, nodes, their bit rate" + Rate();
  if (controller_.pending > 0) {
    text += "; waiting frames: " + std::to_string(controller_.pending) + " (ip link set " + interface_ +
            " down drops them)";
  }
  return text;
}

std::string CanWatch::StateText(State state, std::string_view name) const {
  const int tec = controller_.tec;
  const int rec = controller_.rec;
  std::string text(name);
  if (controller_.state != state) {
    text = "was " + text;
  } else if (tec >= 0 && rec >= 0) {
    text += " (tec " + std::to_string(tec) + ", rec " + std::to_string(rec) + "): what it " +
            (tec >= rec ? "sends" : "receives") + " is damaged";
  }
  return text + "; check bit rate" + Rate() + ", " + kWiring;
}

std::string CanWatch::LostText() const {
  if (controller_.overruns > 0) {
    return "the controller lost " + std::to_string(controller_.overruns) +
           " frames: this computer serves it too late; spare load, or use another adapter";
  }
  return std::to_string(controller_.dropped) +
         " frames lost: this driver reads them too late; realtime: priority, and as root: sysctl -w "
         "net.core.rmem_max=8388608";
}

BusHealth::BusHealth(const BusConfig& config, const Origin& origin, const Timebase& time, MessageSink& sink)
    : time_(time),
      sink_(sink),
      channel_("BUS/" + config.name),
      message_{},
      times_channel_("BUS_TIMES/" + config.name),
      times_{},
      wire_limit_hz_(WireLimit(config)) {
  origin.Set(message_);
  message_.bus = config.name;
  message_.family = config.family != nullptr ? std::string(config.family->name) : std::string();
  message_.port = CappedText(config.link.port, kPortBytes);
  message_.can_tec = -1;
  message_.can_rec = -1;
  message_.wire_limit_hz = static_cast<float>(wire_limit_hz_);
  previous_ = message_;
  origin.Set(times_);
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
