#include "drivers/runtime/axis/device_health.h"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/config/ticks.h"

namespace axlecast {
namespace {

constexpr MonoNs kWindow = kSecond;
constexpr std::int32_t kBurst = 10;
constexpr std::int64_t kMinErrors = 3;
constexpr double kDegradedShare = 0.01;
constexpr double kRecoveredShare = 0.005;
constexpr MonoNs kNoValidFor = 100 * kMillisecond;
constexpr int kNoValidCount = 3;
constexpr int kDecodedToReturn = 3;

// Returns false for unexpected bytes, which are not a reading.
bool IsReading(ErrorKind kind) { return kind != ErrorKind::kUnexpectedBytes; }

constexpr std::size_t kSerialBytes = 32;
constexpr std::size_t kWhyBytes = 120;
constexpr std::size_t kMaxOperations = 24;

MonoNs Period(double hz) { return hz > 0 ? static_cast<MonoNs>(static_cast<double>(kSecond) / hz) : 0; }

std::int32_t Microseconds(MonoNs ns) {
  return static_cast<std::int32_t>(std::min<MonoNs>(ns / kMicrosecond, INT32_MAX));
}

// Adds the operations for which `permits` returns true.
template <typename Permits>
void AddOperations(std::span<const OperationSpec> operations, Permits permits, device_info_t& info) {
  for (const OperationSpec& operation : operations) {
    if (operation.internal || !permits(operation.name) || info.operations.size() == kMaxOperations) continue;
    info.operations.push_back(CappedText(operation.name, kNameBytes));
  }
}

}  // namespace

void DeviceHealth::Count(ErrorKind kind) {
  ++errors_[static_cast<std::size_t>(kind)];
  if (IsReading(kind)) {
    ++window_errors_[static_cast<std::size_t>(kind)];
  } else {
    ++window_strays_;
  }
}

void DeviceHealth::OnGood(MonoNs at) {
  ++good_;
  ++window_good_;
  last_good_ = at;
  last_result_ = at;
  if (!AnswersAgain()) return;
  decoded_at_ = at;
  failures_ = 0;
  doubtful_ = 0;
  SetNotPolled(false);
  if (mode_ == Mode::kAnswering && !no_valid_) return;
  no_valid_ = false;
  Enter(Mode::kAnswering, "", at);
}

void DeviceHealth::OnDoubtful(ErrorKind kind, MonoNs at) {
  Count(kind);
  last_result_ = at;
  if (!AnswersAgain()) return;
  decoded_at_ = at;
  failures_ = 0;
  ++doubtful_;
  SetNotPolled(false);
  const MonoNs since = std::max(last_good_ == kNever ? entered_ : last_good_, entered_);
  const bool no_valid = no_valid_ || (doubtful_ >= kNoValidCount && at - since >= kNoValidFor);
  if (mode_ == Mode::kAnswering && no_valid == no_valid_) return;
  no_valid_ = no_valid;
  no_valid_kind_ = kind;
  Enter(Mode::kAnswering, "", at);
}

bool DeviceHealth::AnswersAgain() {
  if (!undecodable_) return true;
  if (++decoded_ < kDecodedToReturn) return false;
  undecodable_ = false;
  share_ = std::string("it answers again after failures with ") + ErrorName(last_failure_);
  window_begin_ = 0;
  return true;
}

void DeviceHealth::OnFailure(ErrorKind kind, MonoNs at) {
  Count(kind);
  if (!IsReading(kind)) return;
  decoded_ = 0;
  last_result_ = at;
  if (failures_++ == 0) first_failure_ = at;
  SetNotPolled(false);
  last_failure_ = kind;
  UpdateSilence(at);
}

void DeviceHealth::UpdateSilence(MonoNs now) {
  const bool starting = mode_ == Mode::kStarting;
  if (!starting && mode_ != Mode::kAnswering) return;
  if (entered_ == 0) entered_ = now;
  const MonoNs lasted = now - std::max(decoded_at_, entered_);
  const bool silent =
      starting ? failures_ >= 3 && lasted >= 2 * kSecond
               : (failures_ >= 10 && lasted >= 100 * kMillisecond) || (failures_ >= 3 && lasted >= kSecond) ||
                     (failures_ > 0 && last_failure_ == ErrorKind::kSilent && now - first_failure_ >= MaxSilence());
  if (!silent) return;
  undecodable_ = last_failure_ != ErrorKind::kTimeout && last_failure_ != ErrorKind::kSilent;
  Enter(Mode::kSilent, std::string("no usable answer; the last reading failed with ") + ErrorName(last_failure_),
        now);
}

void DeviceHealth::OnStarting(std::string_view reason, MonoNs now) {
  if (mode_ == Mode::kStarting && reason == mode_reason_) return;
  Enter(Mode::kStarting, reason, now);
}

void DeviceHealth::OnRefused(std::string_view reason, MonoNs now) {
  if (mode_ == Mode::kRefused && reason == mode_reason_) return;
  Enter(Mode::kRefused, reason, now);
}

void DeviceHealth::OnLink(bool up, std::string_view reason, MonoNs now) {
  if (!up) {
    if (mode_ != Mode::kLinkDown || reason != mode_reason_) Enter(Mode::kLinkDown, reason, now);
  } else if (mode_ == Mode::kLinkDown || last_result_ == 0) {
    Enter(Mode::kStarting, "the link is up; nothing read yet", now);
  }
}

void DeviceHealth::SetAlarm(std::string_view name) {
  if (name == alarm_) return;
  alarm_ = name;
  Evaluate();
}

void DeviceHealth::Tick(MonoNs now) {
  if (window_begin_ == 0) window_begin_ = now;
  if (now - window_begin_ >= kWindow) CloseWindow(now);
  // A stream that has stalled reports one failure only.
  if (failures_ > 0) UpdateSilence(now);
  SetNotPolled(mode_ == Mode::kAnswering && now - std::max(last_result_, entered_) >= MaxSilence());
}

// A device that was not polled has not failed.
void DeviceHealth::SetNotPolled(bool not_polled) {
  if (not_polled == not_polled_) return;
  not_polled_ = not_polled;
  Evaluate();
}

void DeviceHealth::CloseWindow(MonoNs now) {
  const std::int64_t bad = std::accumulate(window_errors_.begin(), window_errors_.end(), std::int64_t{0});
  const double share = bad == 0 ? 0 : static_cast<double>(bad) / static_cast<double>(bad + window_good_);
  const bool many = bad >= kMinErrors && share > (share_.empty() ? kDegradedShare : kRecoveredShare);
  share_.clear();
  if (many) {
    const auto worst = std::max_element(window_errors_.begin(), window_errors_.end());
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "%.1f %% of the readings fail, most with %s", share * 100,
                  ErrorName(static_cast<ErrorKind>(worst - window_errors_.begin())));
    share_ = text.data();
  }
  implausible_burst_ = window_errors_[static_cast<std::size_t>(ErrorKind::kImplausible)] >= kBurst;
  stray_burst_ = window_strays_ >= kBurst;
  window_strays_ = 0;
  window_begin_ = now;
  window_good_ = 0;
  window_errors_.fill(0);
  Evaluate();
}

void DeviceHealth::Enter(Mode mode, std::string_view reason, MonoNs now) {
  if (mode != mode_ || entered_ == 0) entered_ = now;
  not_polled_ = false;
  if (mode != Mode::kAnswering) no_valid_ = false;
  if (mode != mode_ && mode != Mode::kSilent) failures_ = 0;
  if (mode != Mode::kSilent) undecodable_ = false;
  mode_ = mode;
  mode_reason_ = reason;
  Evaluate();
}

void DeviceHealth::Evaluate() {
  switch (mode_) {
    case Mode::kStarting:
      return Publish(device_info_t::STATE_STARTING, mode_reason_);
    case Mode::kSilent:
    case Mode::kRefused:
    case Mode::kLinkDown:
      return Publish(device_info_t::STATE_OFFLINE, mode_reason_);
    case Mode::kAnswering:
      break;
  }
  if (no_valid_) {
    return Publish(device_info_t::STATE_DEGRADED,
                   std::string("it answers, but no position is valid: ") + ErrorName(no_valid_kind_));
  }
  if (not_polled_) {
    return Publish(device_info_t::STATE_DEGRADED,
                   "it was not polled for a second: the line is not idle, or other requests took every slot");
  }
  if (!alarm_.empty()) return Publish(device_info_t::STATE_DEGRADED, "alarm " + alarm_);
  if (!share_.empty()) return Publish(device_info_t::STATE_DEGRADED, share_);
  Publish(device_info_t::STATE_ONLINE, "");
}

void DeviceHealth::Publish(std::int8_t state, std::string_view reason) {
  if (state == state_ && reason == reason_) return;
  state_ = state;
  reason_ = reason;
  ++revision_;
}

MonoNs PollPeriod(const BusConfig& bus, const DeviceConfig& device) {
  if (device.settings->own_period > 0) return device.settings->own_period;
  return bus.poll_hz > 0 ? Period(bus.poll_hz) : RoundTime(bus);
}

MonoNs DeviceReport::MaxAge(MonoNs poll, MonoNs publish) {
  return std::max(20 * kMillisecond, 3 * std::max(poll, publish));
}

DeviceReport::DeviceReport(const BusConfig& bus, const DeviceConfig& device, const Origin& origin) : info_{} {
  const MonoNs publish = Period(device.publish_hz);
  origin.Set(info_);
  info_.seq = -1;
  info_.device = CappedText(device.name, kNameBytes);
  info_.bus = CappedText(bus.name, kNameBytes);
  info_.family = CappedText(bus.family != nullptr ? bus.family->name : "", kNameBytes);
  info_.model = CappedText(device.model, kNameBytes);
  info_.identity = -1;
  info_.config_hash = device.config_hash;
  info_.counts_per_turn = device.settings->counts_per_turn;
  info_.turns_range = device.settings->turns_range;
  info_.ratio_num = device.ratio_num;
  info_.ratio_den = device.ratio_den;
  info_.per_turn = device.per_turn;
  info_.direction = static_cast<std::int8_t>(device.direction);
  info_.unit = device.unit;
  info_.modulo = device.modulo;
  info_.poll_us = Microseconds(Period(bus.poll_hz));
  if (IsReadOnTicks(bus, device)) {
    const Ticks ticks = TicksOf(bus);
    info_.tick_period_ns = ticks.period;
    info_.tick_phase_ns = ticks.phase;
    info_.tick_lead_ns = ticks.lead;
  }
  info_.publish_us = Microseconds(publish);
  info_.max_age_us = Microseconds(MaxAge(PollPeriod(bus, device), publish));
  if (bus.family != nullptr) {
    const auto permits = [&](std::string_view operation) {
      return bus.family->permits == nullptr || bus.family->permits(bus, device, operation);
    };
    AddOperations(bus.family->operations, permits, info_);
    AddOperations(
        RuntimeOperations(*bus.family), [](std::string_view) { return true; }, info_);
  }
  info_.n_operations = static_cast<std::int8_t>(info_.operations.size());
}

void DeviceReport::SetIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) {
  if (identity == info_.identity && serial == info_.serial && firmware == info_.firmware) return;
  info_.identity = identity;
  info_.serial = CappedText(serial, kSerialBytes);
  info_.firmware = CappedText(firmware, kSerialBytes);
  identity_ = identity < 0 ? "" : std::to_string(identity);
  if (!info_.serial.empty()) identity_ += (identity_.empty() ? "" : " ") + info_.serial;
  ++revision_;
}

void DeviceReport::SetProductCode(std::string_view code) {
  if (code == info_.product_code) return;
  info_.product_code = CappedText(code, kSerialBytes);
  ++revision_;
}

void DeviceReport::CountNonVolatileWrite() {
  ++info_.nv_writes;
  ++revision_;
}

const device_info_t& DeviceReport::Write(const DeviceHealth& health, const Reference& reference,
                                         const Timebase& time, MonoNs now) {
  ++info_.seq;
  info_.mono_ns = now;
  info_.utime = time.Utime(now);
  info_.state = health.state();
  if (health_revision_ != health.revision()) info_.reason = CappedText(health.reason(), kWhyBytes);
  health_revision_ = health.revision();
  info_.datum_counts = reference.datum();
  info_.datum_utime = reference.datum_unix_us();
  info_.datum_epoch = reference.epoch();
  info_.reference_lost = reference.lost() ? 1 : 0;
  info_.good = health.good();
  for (std::size_t i = 0; i < kErrorKinds; ++i) info_.errors[i] = health.errors(static_cast<ErrorKind>(i));
  info_.last_good_utime = health.last_good() == kNever ? 0 : time.Utime(health.last_good());
  return info_;
}

}  // namespace axlecast
