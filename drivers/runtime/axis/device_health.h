#pragma once

#include <array>
#include <axlecast/device_info_t.hpp>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/reading.h"
#include "core/messages/origin.h"
#include "drivers/runtime/axis/axis.h"

namespace axlecast {

// The state of a device in device_info_t, and the counts from which it follows.
//
//   STARTING  the link is up and nothing was read yet, or the device reports that it is powering up
//   ONLINE    the device answers, and its position may be used
//   DEGRADED  the device answers, but one of these holds:
//             - more than 1 % of its readings (at least three) failed or were implausible in the last second, until
//               less than 0.5 % do
//             - no reading was valid for 100 ms
//             - an alarm of severity ERROR or above is present
//             - the device was not polled for 1 s and ten poll periods: its readings are old
//   OFFLINE   the link is down, the device is refused, or the device is silent:
//             - ten consecutive failures over 100 ms, or three over 1 s
//             - a stream paused for 1 s and ten poll periods
//             - while starting, three failures over 2 s (an encoder without battery answers 1.5 s after power-on,
//               TS5669 spec 5.4)
//
// If undecodable bytes made the device OFFLINE, a single reply that can be decoded may be chance. Three consecutive ones
// are required. The device is then DEGRADED until a second has passed with few failures.
class DeviceHealth {
 public:
  explicit DeviceHealth(MonoNs poll_period) : poll_period_(poll_period) {}

  void OnGood(MonoNs at);
  void OnDoubtful(ErrorKind kind, MonoNs at);  // decoded, not usable
  void OnFailure(ErrorKind kind, MonoNs at);
  void OnStarting(std::string_view reason, MonoNs now);
  void OnRefused(std::string_view reason, MonoNs now);
  void OnLink(bool up, std::string_view reason, MonoNs now);
  // Sets the name of the worst alarm of severity ERROR or above; empty: there is no such alarm.
  void SetAlarm(std::string_view name);
  void Tick(MonoNs now);

  [[nodiscard]] std::int8_t state() const { return state_; }  // device_info_t STATE_*
  [[nodiscard]] const std::string& reason() const { return reason_; }
  // Increments whenever state or reason changes.
  [[nodiscard]] std::int64_t revision() const { return revision_; }
  // Returns true if ten or more readings of the last full second were implausible.
  [[nodiscard]] bool implausible_burst() const { return implausible_burst_; }
  // Returns true if unexpected bytes came ten times or more within the last full second.
  [[nodiscard]] bool stray_burst() const { return stray_burst_; }

  [[nodiscard]] std::int64_t good() const { return good_; }
  [[nodiscard]] MonoNs last_good() const { return last_good_; }  // kNever: no reading was good
  [[nodiscard]] std::int64_t errors(ErrorKind kind) const { return errors_[static_cast<std::size_t>(kind)]; }

 private:
  enum class Mode : std::uint8_t { kStarting, kAnswering, kSilent, kRefused, kLinkDown };

  void Count(ErrorKind kind);
  void SetNotPolled(bool not_polled);
  void Enter(Mode mode, std::string_view reason, MonoNs now);
  void UpdateSilence(MonoNs now);
  // Counts a decoded reading. Returns false while it may be chance.
  [[nodiscard]] bool AnswersAgain();
  void CloseWindow(MonoNs now);
  [[nodiscard]] MonoNs MaxSilence() const { return kSecond + 10 * poll_period_; }
  void Evaluate();
  void Publish(std::int8_t state, std::string_view reason);

  MonoNs poll_period_;
  Mode mode_ = Mode::kStarting;
  MonoNs entered_ = 0;
  std::string mode_reason_ = "nothing read yet";
  std::string alarm_;
  std::string share_;                             // "2.5 % of the readings fail, ..."; empty when few do
  bool no_valid_ = false;                         // the device answers, but no reading is valid
  bool not_polled_ = false;                       // no reading succeeded or failed for a long time
  ErrorKind no_valid_kind_ = ErrorKind::kDevice;  // why none was, when that began
  ErrorKind last_failure_ = ErrorKind::kTimeout;

  std::int64_t good_ = 0;
  std::array<std::int64_t, kErrorKinds> errors_{};
  MonoNs last_good_ = kNever;
  MonoNs decoded_at_ = 0;      // last decoded reading, or start of the mode
  MonoNs last_result_ = 0;     // last reading or failure
  std::int64_t failures_ = 0;  // in a row
  MonoNs first_failure_ = 0;   // of these
  int doubtful_ = 0;           // in a row

  MonoNs window_begin_ = 0;
  std::int64_t window_good_ = 0;
  std::array<std::int32_t, kErrorKinds> window_errors_{};
  bool implausible_burst_ = false;
  std::int32_t window_strays_ = 0;
  bool stray_burst_ = false;
  bool undecodable_ = false;  // OFFLINE because of bytes that cannot be decoded
  int decoded_ = 0;           // consecutive replies, while undecodable_

  std::int8_t state_ = 0;
  std::string reason_ = mode_reason_;
  std::int64_t revision_ = 0;
};

// Composes the device_info_t of one device.
class DeviceReport {
 public:
  DeviceReport(const BusConfig& bus, const DeviceConfig& device, const Origin& origin);

  void SetIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware);
  // Returns what identifies the device for an operator: "17", "17 SN0042"; empty: unknown.
  [[nodiscard]] std::string_view identity() const { return identity_; }
  void SetProductCode(std::string_view code);
  // `base_id`: of the time base at present; 0: none, or the ticks are of CLOCK_MONOTONIC.
  void SetTickBase(std::int64_t base_id) { info_.tick_base_id = base_id; }
  void CountNonVolatileWrite();
  [[nodiscard]] std::int64_t nv_writes() const { return info_.nv_writes; }
  // Increments with every change of the identity or the counts.
  [[nodiscard]] std::int64_t revision() const { return revision_; }

  // Returns the message for `now`, with the next seq.
  [[nodiscard]] const device_info_t& Write(const DeviceHealth& health, const Reference& reference,
                                           const Timebase& time, MonoNs now);

  // Returns the age at which a reading is stale: three missing readings or messages, at least 20 ms.
  [[nodiscard]] static MonoNs MaxAge(MonoNs poll, MonoNs publish);

 private:
  device_info_t info_;
  std::string identity_;
  std::int64_t revision_ = 0;
  std::int64_t health_revision_ = -1;
};

// Returns the time between two readings of one device: its own, the configured one, or what the bus allows.
[[nodiscard]] MonoNs PollPeriod(const BusConfig& bus, const DeviceConfig& device);

}  // namespace axlecast
