#include "tools/service/hardware_watch.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <cmath>
#include <numbers>

#include "core/base/text.h"
#include "core/device/reading.h"
#include "core/messages/enum_names.h"
#include "core/messages/message.h"
#include "tools/service/error_trend.h"

namespace axlecast {
namespace {

constexpr double kStretch = 0.02;  // s
constexpr double kGap = 1;         // s without a valid position, after which the measurement restarts
// Below this speed, the shaft is considered stationary, and no limit is proposed.
constexpr double kMinMotionRpm = 10;
// If more than this share of a limit was reached, the margin is too small.
constexpr double kNear = 0.8;

double Rpm(double rad_s) { return rad_s * 60 / (2 * std::numbers::pi); }

constexpr double kBadShare = 1e-3;  // of failed readings

std::string OrNone(const std::string& text) { return text.empty() ? "not reported by the device" : text; }

Verdict OfSeverity(std::int8_t severity) {
  if (severity >= alarm_entry_t::SEVERITY_ERROR) return Verdict::kBad;
  return severity == alarm_entry_t::SEVERITY_WARNING ? Verdict::kAttention : Verdict::kUnjudged;
}

float Median(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::int64_t Failed(const device_info_t& first, const device_info_t& last) {
  std::int64_t sum = 0;
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) sum += Growth(first.errors[kind], last.errors[kind]);
  return sum;
}

AcceptanceResult StateFinding(const char* what, bool good, std::string_view state, const std::string& reason) {
  return {what, std::string(state) + (reason.empty() ? "" : ": " + reason), good ? Verdict::kGood : Verdict::kBad,
          good ? "" : "fix this first: the other results are meaningless until then"};
}

// Returns the advice if there was no reply at all.
std::string NothingAnswers(LinkKind link) {
  switch (link) {
    case LinkKind::kCan:
      return "nothing comes: CAN_H and CAN_L, 120 ohm at both ends, supply, node ID and bit rate of the device";
    case LinkKind::kSpi:
      return "nothing is clocked in: clock and data lines, supply, level of the interface, chip select";
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return "nothing answers: wires A and B (crossed?), supply, address and rate of the device";
}

// Returns the advice if some replies are missing.
std::string Intermittent(LinkKind link) {
  if (link == LinkKind::kCan) return "it answers, not always: a loose contact, or a bus load that holds frames up";
  if (link == LinkKind::kSpi) return "it answers, not always: a loose contact, or a clock too fast for the cable";
  return "it answers, not always: a loose contact at A and B, noise that destroys requests, or a timeout too short "
         "for the adapter's latency";
}

std::string Noise(LinkKind link) {
  if (link == LinkKind::kSpi)
    return "noise or a clock too fast for the cable: shield, twisted pairs, lower clock_hz";
  return "noise or a wrong rate: shield, 120 ohm at both ends, common ground, cable away from the motor's";
}

}  // namespace

double ProposedLimit(double seen, double margin, double maximum) {
  const double wanted = std::max(seen * margin, 1.0);
  const double digit = std::pow(10, std::floor(std::log10(wanted)) - 1);
  const double limit = std::ceil(wanted / digit - 1e-9) * digit;
  return maximum > 0 ? std::min(limit, maximum) : limit;
}

void MotionWatch::On(const position_t& position) {
  const double seconds = begin_ ? static_cast<double>(position.mono_ns - begin_->mono_ns) * 1e-9 : 0;
  if (!begin_ || begin_->boot_id != position.boot_id || begin_->datum_epoch != position.datum_epoch ||
      seconds > kGap) {
    begin_ = position;
    before_.reset();
    return;
  }
  if (seconds < kStretch) return;
  const double turns =
      static_cast<double>(position.counts - begin_->counts) / static_cast<double>(position.counts_per_turn);
  const Stretch now{seconds, turns * 2 * std::numbers::pi / seconds};
  speed_rpm_ = std::max(speed_rpm_, Rpm(std::abs(now.rad_s)));
  if (before_) {
    const double middles = (before_->seconds + now.seconds) / 2;
    accel_rad_s2_ = std::max(accel_rad_s2_, std::abs(now.rad_s - before_->rad_s) / middles);
  }
  before_ = now;
  begin_ = position;
}

FindingGroup MotionWatch::Evaluate(const DeviceConfig& device) const {
  FindingGroup group{"Motion", {}};
  group.Add("fastest seen", Text("%.4g rpm, %.4g rad/s2", speed_rpm_, accel_rad_s2_));
  const bool own = device.speed_rpm > 0 && device.accel_rad_s2 > 0;
  const double max_rpm = device.settings ? device.settings->max_speed_rpm : 0;
  const double max_accel = device.settings ? device.settings->max_accel_rad_s2 : 0;
  const double rpm = device.speed_rpm > 0 ? device.speed_rpm : max_rpm;
  const double accel = device.accel_rad_s2 > 0 ? device.accel_rad_s2 : max_accel;
  const std::string proposal =
      Text("limits: {speed_rpm: %.10g, accel_rad_s2: %.10g}", ProposedLimit(speed_rpm_, kSpeedMargin, max_rpm),
           ProposedLimit(accel_rad_s2_, kAccelMargin, max_accel));
  Verdict verdict = own ? Verdict::kGood : Verdict::kUnjudged;
  std::string advice;
  if (own && (speed_rpm_ > kNear * rpm || accel_rad_s2_ > kNear * accel)) {
    verdict = Verdict::kAttention;
    advice = "the axis comes near them; good readings beyond them are not published as valid: " + proposal;
  } else if (!own && speed_rpm_ < kMinMotionRpm) {
    advice =
        "run it again while the axis makes its fastest motions, including an emergency stop: it then proposes "
        "limits";
  } else if (!own) {
    advice = proposal + Text(
                            " in the machine's file (%g and %g times the measured values) detects far more damaged "
                            "readings, if no motion is faster than these",
                            kSpeedMargin, kAccelMargin);
  }
  group.Add(own ? "limits of the axis" : "limits of the model only",
            Text("%.6g rpm, ", rpm) + (accel > 0 ? Text("%.6g rad/s2", accel) : "no acceleration"), verdict,
            std::move(advice));
  return group;
}

std::string ErrorAdvice(std::size_t kind, const Family* family, bool some_good) {
  const LinkKind link = family != nullptr ? family->link : LinkKind::kSerial;
  switch (kind) {
    case device_info_t::ERROR_TIMEOUT:
    case device_info_t::ERROR_SILENT:
      return some_good ? Intermittent(link) : NothingAnswers(link);
    case device_info_t::ERROR_SHORT:
    case device_info_t::ERROR_FRAMING:
    case device_info_t::ERROR_CHECKSUM:
      return some_good ? Noise(link) : Noise(link) + "; every reading fails: rate, parity and model first";
    case device_info_t::ERROR_WRONG_ECHO:
    case device_info_t::ERROR_STRAY:
      if (link == LinkKind::kSpi) return "another process clocks this device, or the model is another";
      return link == LinkKind::kCan ? "another node has the same node ID, or answers late"
                                    : "another master or device transmits on the line, or link.echo is wrong";
    case device_info_t::ERROR_WRONG_IDENTITY:
      return "another model or unit than in the machine's file";
    case device_info_t::ERROR_IO:
      return link == LinkKind::kSpi ? "the SPI driver refuses: rights of the spidev node, kernel log (dmesg)"
                                    : "the adapter: plug, USB cable, kernel log (dmesg)";
    case device_info_t::ERROR_IMPLAUSIBLE:
      return some_good
                 ? "single readings far from the others: noise, or limits in the machine's file that are too tight"
                 : "model, resolution and limits in the machine's file";
    case device_info_t::ERROR_RANGE:
      return "model and resolution in the machine's file; else noise";
    case device_info_t::ERROR_BUSY:
      return "the device is at work (a write to its memory): wait, and test again";
    case device_info_t::ERROR_COMMUNICATION_ALARM:
      return "the device misread the request: noise on the way to it, or two masters on the line";
    case device_info_t::ERROR_EXCEPTION:
      return "the device refuses the request: address, model and register numbers, its manual";
    default:
      return "the device reports this error: see its alarms and its manual";
  }
}

AcceptanceResult EvaluateRotation(double turns, std::int8_t direction) {
  AcceptanceResult finding{"one turn by hand", Text("%+.3f turns", turns), Verdict::kGood, ""};
  const char* const positive = direction >= 0 ? "counter-clockwise" : "clockwise";
  if (std::abs(turns) < 0.05) {
    finding.verdict = Verdict::kBad;
    finding.advice = "nothing moved: is it this encoder's shaft, and is its coupling tight?";
  } else if (turns < 0) {
    finding.verdict = Verdict::kBad;
    finding.advice = std::string("it counts backwards: turned ") + positive +
                     " it must rise; set direction: " + (direction >= 0 ? "cw" : "ccw") +
                     " or turn the other way round";
  } else if (turns < 0.85 || turns > 1.15) {
    finding.verdict = Verdict::kAttention;
    finding.advice =
        "not one turn: a gear in between (ratio), a slipping coupling, or another resolution than configured";
  }
  return finding;
}

void HardwareWatch::OnMessage(std::string_view channel, Bytes message) {
  if (channel == "DEVICE/" + device_.name) {
    if (auto info = DecodeMessage<device_info_t>(message)) {
      if (!first_info_ || first_info_->boot_id != info->boot_id) first_info_ = info;
      info_ = std::move(info);
      ++infos_;
    }
  } else if (channel == "BUS/" + bus_config_.name) {
    if (auto bus = DecodeMessage<bus_health_t>(message)) {
      if (!first_bus_ || first_bus_->boot_id != bus->boot_id) first_bus_ = bus;
      const auto& us = bus->exchange_us;
      if (buses_ > 0 && std::isfinite(us[0])) {  // the first window may be from before
        fastest_us_ = fastest_us_ == 0 ? us[0] : std::min(fastest_us_, us[0]);
        slowest_p99_us_ = std::max(slowest_p99_us_, us[2]);
        p50_us_.push_back(us[1]);
      }
      bus_ = std::move(bus);
      ++buses_;
    }
  } else if (channel == "ALARM/" + device_.name) {
    if (const auto alarms = DecodeMessage<alarm_t>(message)) {
      alarms_ = alarms->entries;
      has_alarms_ = true;
    }
  } else if (channel == "POSITION/" + device_.name) {
    if (const auto position = DecodeMessage<position_t>(message)) {
      ++positions_;
      if ((position->flags & position_t::FLAG_VALID) != 0) {
        position_ = position;
        motion_.On(*position);
      } else {
        ++invalid_;
      }
    }
  }
}

std::int64_t HardwareWatch::readings() const { return info_ ? Growth(first_info_->good, info_->good) : 0; }
std::int64_t HardwareWatch::errors() const { return info_ ? Failed(*first_info_, *info_) : 0; }

Findings HardwareWatch::Evaluate() const {
  Findings findings;
  AddIdentity(findings);
  AddReadings(findings);
  AddBus(findings);
  AddAlarms(findings);
  if (position_) findings.push_back(motion_.Evaluate(device_));
  return findings;
}

void HardwareWatch::AddIdentity(Findings& findings) const {
  FindingGroup& group = findings.emplace_back(FindingGroup{"Device", {}});
  if (!info_) return;
  const bool online = info_->state == device_info_t::STATE_ONLINE;
  group.findings.push_back(StateFinding("state", online, DeviceStateName(info_->state), info_->reason));
  const bool other = info_->errors[device_info_t::ERROR_WRONG_IDENTITY] > 0;
  group.Add("model", info_->family + ", " + info_->model, other ? Verdict::kBad : Verdict::kGood,
            other ? ErrorAdvice(device_info_t::ERROR_WRONG_IDENTITY, bus_config_.family, true) : "");
  group.Add("serial number", OrNone(info_->serial));
  group.Add("firmware", OrNone(info_->firmware));
  if (info_->identity >= 0) {
    group.Add("identity", Text("0x%llX", static_cast<long long>(info_->identity)));
  }
  if (info_->counts_per_turn > 0) {
    group.Add("resolution",
              std::to_string(info_->counts_per_turn) + " counts a turn, " +
                  (info_->turns_range > 0 ? std::to_string(info_->turns_range) + " turns" : "single-turn"));
  }
  if (device_.settings && info_->reference_lost != 0) {
    group.Add("reference", "lost", Verdict::kAttention, "home it: axlecast home " + device_.name);
  }
}

void HardwareWatch::AddReadings(Findings& findings) const {
  FindingGroup& group = findings.emplace_back(FindingGroup{"Readings", {}});
  const std::int64_t good = readings();
  const std::int64_t failed = errors();
  const double share = good + failed > 0 ? static_cast<double>(failed) / static_cast<double>(good + failed) : 1;
  AcceptanceResult all{"good readings", std::to_string(good) + " of " + std::to_string(good + failed),
                       Verdict::kGood, ""};
  if (failed > 0 || good == 0) all.verdict = share > kBadShare ? Verdict::kBad : Verdict::kAttention;
  if (good == 0) all.advice = NoReadingAdvice();
  group.findings.push_back(std::move(all));
  if (!info_) return;
  for (std::size_t kind = 0; kind < kErrorKinds; ++kind) {
    const std::int64_t count = Growth(first_info_->errors[kind], info_->errors[kind]);
    if (count == 0) continue;
    group.Add("failed: " + std::string(ErrorName(static_cast<ErrorKind>(kind))), std::to_string(count),
              share > kBadShare ? Verdict::kBad : Verdict::kAttention,
              ErrorAdvice(kind, bus_config_.family, good > 0));
  }
  if (positions_ == 0) return;
  group.Add("positions not valid", std::to_string(invalid_) + " of " + std::to_string(positions_),
            invalid_ == 0 ? Verdict::kGood : Verdict::kAttention,
            invalid_ == 0 ? "" : "axlecast watch --channel POSITION/" + device_.name + " shows their flags");
}

std::string HardwareWatch::NoReadingAdvice() const {
  if (bus_ && bus_->state == bus_health_t::STATE_DOWN) return "the bus is down: " + bus_->last_error;
  if (!info_) return "no message from its driver: is it running (axlecast status)?";
  return info_->reason.empty() ? "no reading in this time: watch longer (--seconds)" : info_->reason;
}

void HardwareWatch::AddBus(Findings& findings) const {
  FindingGroup& group = findings.emplace_back(FindingGroup{"Bus " + bus_config_.name, {}});
  if (!bus_) return;
  const bool up = bus_->state == bus_health_t::STATE_UP;
  group.findings.push_back(StateFinding("state", up, BusStateName(bus_->state), up ? "" : bus_->last_error));
  const float p50 = Median(p50_us_);
  if (fastest_us_ > 0) {
    const double wire_us = bus_->wire_limit_hz > 0 ? 1e6 / static_cast<double>(bus_->wire_limit_hz) : 0;
    const bool slow = wire_us > 0 && static_cast<double>(p50) > 5 * wire_us + 1'000;
    const bool uneven = slowest_p99_us_ > 10 * p50 + 1'000;
    AcceptanceResult turnaround{"turnaround",
                                Text("min %.0f us, p50 %.0f us, p99 %.0f us", static_cast<double>(fastest_us_),
                                     static_cast<double>(p50), static_cast<double>(slowest_p99_us_)),
                                slow || uneven ? Verdict::kAttention : Verdict::kGood, ""};
    if (slow)
      turnaround.advice =
          "slow for the wire: the USB adapter's latency timer (1 ms), or a device that takes its time";
    if (uneven && !slow) turnaround.advice = "uneven: the host is late (realtime.priority), or others load it";
    group.findings.push_back(std::move(turnaround));
  }
  const std::int64_t late = Growth(first_bus_->late, bus_->late);
  const std::int64_t exchanges = std::max<std::int64_t>(Growth(first_bus_->exchanges, bus_->exchanges), 1);
  group.Add("rate",
            Text("%.1f exchanges/s, the wire allows %.1f", static_cast<double>(bus_->rate_hz),
                 static_cast<double>(bus_->wire_limit_hz)),
            late * 100 > exchanges ? Verdict::kAttention : Verdict::kGood,
            late * 100 > exchanges ? std::to_string(late) + " slots missed: lower poll_hz" : "");
  const std::int64_t reopens = Growth(first_bus_->reopens, bus_->reopens);
  const std::int64_t dropped = Growth(first_bus_->rx_dropped, bus_->rx_dropped);
  group.Add("line",
            std::to_string(reopens) + " times opened again, " + std::to_string(dropped) +
                " bytes lost by host or adapter",
            reopens + dropped == 0 ? Verdict::kGood : Verdict::kBad,
            reopens + dropped == 0 ? "" : "plug, USB cable and hub; dmesg");
}

void HardwareWatch::AddAlarms(Findings& findings) const {
  FindingGroup& group = findings.emplace_back(FindingGroup{"Alarms", {}});
  if (!has_alarms_) group.Add("alarms", "not received", Verdict::kAttention, "is its driver running?");
  if (has_alarms_ && alarms_.empty()) group.Add("alarms", "none", Verdict::kGood);
  for (const alarm_entry_t& alarm : alarms_) {
    group.Add(alarm.name,
              std::string(SeverityName(alarm.severity)) + ", " + std::string(AlarmStateName(alarm.state)),
              OfSeverity(alarm.severity), alarm.action);
  }
}

}  // namespace axlecast
