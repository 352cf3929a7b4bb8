#include "drivers/runtime/axis/device_health.h"

#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <cstdio>
#include <numeric>

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

// Bytes that nobody asked for are no reading.
bool IsReading(ErrorKind kind) { return kind != ErrorKind::kUnexpectedBytes; }

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
  told_ = at;
  if (!AnswersAgain()) return;
  heard_ = at;
  failures_ = 0;
  doubtful_ = 0;
  SetUnasked(false);
  if (mode_ == Mode::kAnswering && !no_valid_) return;
  no_valid_ = false;
  Enter(Mode::kAnswering, "", at);
}

void DeviceHealth::OnDoubtful(ErrorKind kind, MonoNs at) {
  Count(kind);
  told_ = at;
  if (!AnswersAgain()) return;
  heard_ = at;
  failures_ = 0;
  ++doubtful_;
  SetUnasked(false);
  const MonoNs since = std::max(last_good_ == kNever ? entered_ : last_good_, entered_);
  const bool no_valid = no_valid_ || (doubtful_ >= kNoValidCount && at - since >= kNoValidFor);
  if (mode_ == Mode::kAnswering && no_valid == no_valid_) return;
  no_valid_ = no_valid;
  last_failure_ = kind;
  Enter(Mode::kAnswering, "", at);
}

bool DeviceHealth::AnswersAgain() {
  if (!babbles_) return true;
  if (++decoded_ < kDecodedToReturn) return false;
  babbles_ = false;
  share_ = std::string("it answers again after failures with ") + ErrorName(last_failure_);
  window_begin_ = 0;
  return true;
}

void DeviceHealth::OnFailure(ErrorKind kind, MonoNs at) {
  Count(kind);
  if (!IsReading(kind)) return;
  decoded_ = 0;
  told_ = at;
  if (failures_++ == 0) first_failure_ = at;
  SetUnasked(false);
  last_failure_ = kind;
  JudgeSilence(at);
}

void DeviceHealth::JudgeSilence(MonoNs now) {
  const bool starting = mode_ == Mode::kStarting;
  if (!starting && mode_ != Mode::kAnswering) return;
  if (entered_ == 0) entered_ = now;
  const MonoNs lasted = now - std::max(heard_, entered_);
  const bool silent =
      starting ? failures_ >= 3 && lasted >= 2 * kSecond
               : (failures_ >= 10 && lasted >= 100 * kMillisecond) || (failures_ >= 3 && lasted >= kSecond) ||
                     (failures_ > 0 && last_failure_ == ErrorKind::kSilent && now - first_failure_ >= Longest());
  if (!silent) return;
  babbles_ = last_failure_ != ErrorKind::kTimeout && last_failure_ != ErrorKind::kSilent;
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
  } else if (mode_ == Mode::kLinkDown || told_ == 0) {
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
  // A stream that fell silent fails once.
  if (failures_ > 0) JudgeSilence(now);
  SetUnasked(mode_ == Mode::kAnswering && now - std::max(told_, entered_) >= Longest());
}

// A device that was not asked has not failed to answer.
void DeviceHealth::SetUnasked(bool unasked) {
  if (unasked == unasked_) return;
  unasked_ = unasked;
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
  unasked_ = false;
  if (mode != Mode::kAnswering) no_valid_ = false;
  if (mode != mode_ && mode != Mode::kSilent) failures_ = 0;
  if (mode != Mode::kSilent) babbles_ = false;
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
                   std::string("it answers, but no position is valid: ") + ErrorName(last_failure_));
  }
  if (unasked_) {
    return Publish(device_info_t::STATE_DEGRADED,
                   "it was not asked for a second: the line is not idle, or other requests took every turn");
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

}  // namespace axlecast
