#include "drivers/runtime/bus/can_watch.h"

#include <algorithm>
#include <utility>

#include "core/alarm/runtime_alarms.h"
#include "core/device/can.h"

namespace axlecast {
namespace {

using State = CanController::State;

constexpr const char* kWiring = "wiring, termination (120 ohm at both ends)";

// What was added to a count that may have begun anew.
std::int64_t More(std::int64_t now, std::int64_t before) { return now >= before ? now - before : now; }

}  // namespace

std::array<CanWatch::Alarm, CanWatch::kKinds> CanWatch::Specs() {
  std::array<Alarm, kKinds> alarms;
  alarms[kBusOff].spec = &runtime_alarms::kCanBusOff;
  alarms[kUnacknowledged].spec = &runtime_alarms::kCanUnacknowledged;
  alarms[kQueueFull].spec = &runtime_alarms::kCanQueueFull;
  alarms[kBusErrors].spec = &runtime_alarms::kCanBusErrors;
  alarms[kErrorPassive].spec = &runtime_alarms::kCanErrorPassive;
  alarms[kFramesLost].spec = &runtime_alarms::kCanFramesLost;
  alarms[kErrorWarning].spec = &runtime_alarms::kCanErrorWarning;
  return alarms;
}

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
    // Of less than a second nothing is known beyond what was counted.
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
            (tec >= rec ? "sends" : "hears") + " is damaged";
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

}  // namespace axlecast
