#pragma once

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/config/ticks.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "core/time/base_claim.h"
#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/device_health.h"

namespace axlecast {

// What a DevicePublisher shares with the rest of its process.
struct DevicePublisherContext {
  Origin origin;
  const Timebase* time = nullptr;
  MessageSink* sink = nullptr;
  std::function<void(const std::string& device, const CommandId& id, const Outcome& outcome)> on_outcome;
  bool redecoded = false;            // readings come from a WIRE recording
  const BaseClaims* base = nullptr;  // about the time base of the machine; null: ticks are of CLOCK_MONOTONIC
};

// Publishes the readings of a motor monitor: MOTOR/<device> at most at the publish rate, TRIP/<device> for each trip, and
// LIMITS/<device> when a limit changed. The newest trip and the limits are repeated every minute. Allocates nothing in
// normal operation.
class MotorOutput {
 public:
  static constexpr MonoNs kRepeat = 60 * kSecond;

  MotorOutput(const std::string& device, double publish_hz, const DevicePublisherContext& context, bool simulated);

  void Take(const MotorReading& reading);
  void Take(const TripRecord& record);
  void Take(const MotorLimits& limits, MonoNs now);
  void Tick(MonoNs now);

 private:
  void SendLimits(MonoNs now);
  [[nodiscard]] std::int64_t UnixUs(MonoNs at) const { return at == 0 ? 0 : context_.time->Utime(at); }

  const DevicePublisherContext context_;
  const bool simulated_;
  MonoNs period_;  // minimum between two MOTOR messages
  std::string motor_channel_;
  std::string trip_channel_;
  std::string limits_channel_;
  motor_health_t motor_{};
  trip_log_t trip_{};  // the newest
  motor_limits_t limits_{};
  std::int64_t trip_seq_ = 0;
  MonoNs motor_at_ = 0;
  MonoNs trip_at_ = kNever;    // when the newest was sent; kNever: none was
  MonoNs limits_at_ = kNever;  // when they were sent; kNever: they are unknown
};

// Selects the readings that become POSITION messages.
//
// Good readings: at most publish_hz; on average exactly publish_hz if readings come faster. If publish_hz is the rate of every n-th tick,
// the readings of the ticks that are multiples of n, so that all devices with this rate publish the same ticks. In addition, at once: the
// first good reading after a published doubtful one, a new datum epoch, and a change of state (the flags of
// kStateFlags), the last at most every 10 ms.
// Doubtful readings: the first of a row at once, but at most every 10 ms; then at 10 Hz until a good one comes. A line
// on which every other reading fails therefore cannot flood the network.
class PublishPace {
 public:
  // poll_hz 0: as fast as the bus allows. publish_hz 0: only what is published at once. `ticks`: TicksPerMessage of the device.
  PublishPace(double publish_hz, double poll_hz, std::int64_t ticks = 0);

  // `tick`: kNoTick if the reading is on none.
  [[nodiscard]] bool Good(MonoNs at, std::int32_t flags, std::int32_t epoch, std::int64_t tick = kNoTick);
  [[nodiscard]] bool Doubtful(MonoNs at);

  static constexpr std::int32_t kStateFlags = std::int32_t{position_t::FLAG_VALID} | position_t::FLAG_TURNS_VALID |
                                              position_t::FLAG_TURNS_WRAPPED | position_t::FLAG_REFERENCED |
                                              position_t::FLAG_LOW_ACCURACY | position_t::FLAG_DEVICE_ERROR |
                                              position_t::FLAG_DEVICE_WARNING | position_t::FLAG_DATUM_CHANGING;
  static constexpr MonoNs kExtraPeriod = 10 * kMillisecond;
  static constexpr MonoNs kDoubtPeriod = 100 * kMillisecond;

 private:
  [[nodiscard]] bool Due(MonoNs at, std::int64_t tick);

  bool every_;          // every reading may be published
  std::int64_t ticks_;  // from one message to the next; 0: ticks do not matter
  std::int64_t due_tick_ = 0;
  MonoNs period_;
  MonoNs due_ = 0;
  bool any_ = false;
  std::int32_t state_ = 0;  // of the last good message
  std::int32_t epoch_ = 0;
  MonoNs extra_at_ = -kExtraPeriod;
  bool in_doubt_ = false;     // the last reading was doubtful
  bool doubt_shown_ = false;  // the last message was doubtful
  MonoNs doubt_at_ = -kDoubtPeriod;
};

// Collects readings at full rate for POSITION_BLOCK: up to 40 consecutive readings of one datum epoch, in ascending order
// of time, over at most 100 ms. Doubtful readings are included, with VALID cleared.
class Block {
 public:
  Block(std::int64_t counts_per_turn, std::int8_t unit, double unit_per_count);

  // Returns true if the block must be sent before this reading can be added.
  [[nodiscard]] bool MustGoBefore(MonoNs at, std::int32_t epoch) const;
  void Add(Interval at, std::int64_t counts, std::int32_t flags, std::int32_t epoch);
  // Counts a reading that failed or was withheld.
  void Miss() { ++message_.missed; }

  [[nodiscard]] bool Full() const { return message_.n == position_block_t::MAX_SAMPLES; }
  // Returns true if the block has waited for 100 ms.
  [[nodiscard]] bool Waited(MonoNs now) const { return !empty() && now - message_.mono_ns >= kLongest; }
  [[nodiscard]] bool empty() const { return message_.n == 0; }

  // Returns the message. The sender sets utime, origin and seq.
  [[nodiscard]] position_block_t& message() { return message_; }
  // Empties the block after it was sent.
  void Clear();

  static constexpr MonoNs kLongest = 100 * kMillisecond;

 private:
  position_block_t message_;
};

// Publishes the readings of one axis: POSITION/<device> at the publish rate, and POSITION_BLOCK/<device> at full rate if it
// is configured.
class PositionOutput {
 public:
  // `axis` and the parts of `context` outlive it.
  PositionOutput(const BusConfig& bus, const DeviceConfig& device, const Axis& axis,
                 const DevicePublisherContext& context);

  // `reading` is the result of Axis::Take(sample).
  void Take(const Sample& sample, const AxisReading& reading);
  // Sets the number of the tick on which the next reading is requested.
  void OnTick(std::int64_t tick) { tick_ = tick; }
  // Counts a failed reading.
  void Miss();
  // Marks a gap: the link is down. No reading fails meanwhile.
  void Interrupt() { gap_ = any_good_; }
  void OnClockStepped() { clock_stepped_ = clock_stepped_in_block_ = true; }
  // Publishes a block that has waited for 100 ms.
  void Tick(MonoNs now) {
    if (block_ && block_->Waited(now)) SendBlock();
  }

 private:
  void SendPosition(const Sample& sample, const AxisReading& reading, std::int32_t flags);
  void AddToBlock(const Sample& sample, const AxisReading& reading, std::int32_t flags);
  void SendBlock();

  const Axis& axis_;
  const Timebase& time_;
  MessageSink& sink_;
  const std::int32_t flags_;  // of every message: SIMULATED, REDECODED
  std::string channel_;
  std::string block_channel_;
  PublishPace pace_;
  position_t position_;
  std::optional<Block> block_;
  std::int64_t tick_ = kNoTick;  // of the reading that was requested last, until it arrives
  bool any_good_ = false;
  bool gap_ = false;          // readings were missed since the last good one
  bool gap_to_send_ = false;  // and no message has reported it
  bool clock_stepped_ = false;
  bool clock_stepped_in_block_ = false;
};

// Publishes one device on LCM: samples as POSITION and POSITION_BLOCK, readings of a monitor as MOTOR, TRIP and LIMITS,
// alarms as ALARM, and the state as DEVICE. Used by the bus's thread only. Allocates nothing in normal operation.
//
// OnSample counts implausible readings (ErrorKind::kImplausible) and readings that the device reports as invalid
// (ErrorKind::kDevice); the device does not report these by OnError. Unexpected bytes are counted, but not as a missed
// reading. After OnJump, the datum of the file, or none, is used.
class DevicePublisher final : public DeviceOutput {
 public:
  DevicePublisher(const BusConfig& bus, const DeviceConfig& device, DevicePublisherContext context);
  DevicePublisher(const DevicePublisher&) = delete;
  DevicePublisher& operator=(const DevicePublisher&) = delete;

  void OnSample(const Sample& sample) override;
  void OnMotor(const MotorReading& reading) override;
  void OnTrip(const TripRecord& record) override;
  void OnMotorLimits(const MotorLimits& limits) override;
  void OnProductCode(std::string_view code) override { report_.SetProductCode(code); }
  void OnError(ErrorKind kind, Interval at) override;
  void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) override;
  void OnIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) override {
    report_.SetIdentity(identity, serial, firmware);
  }
  void OnStarting(std::string_view reason) override { health_.OnStarting(reason, now_); }
  void OnRefused(std::string_view reason) override { health_.OnRefused(reason, now_); }
  void OnNonVolatileWrite() override { report_.CountNonVolatileWrite(); }
  void OnReferenceLost() override { axis_.OnReferenceLost(now_); }
  void OnReferenceRestored() override { axis_.OnReferenceRestored(); }
  void OnJump() override { axis_.OnJump(); }
  void OnDatumChanging(bool changing) override { axis_.OnDatumChanging(changing); }
  void OnOutcome(const CommandId& id, const Outcome& outcome) override {
    if (context_.on_outcome) context_.on_outcome(name_, id, outcome);
  }
  [[nodiscard]] Motion MotionAt(MonoNs now) const override { return axis_.MotionAt(now); }

  // Sets the state of the link. While the link is down, the device is OFFLINE for `reason`.
  void OnLink(bool up, std::string_view reason, MonoNs now);
  // Sets the number of the tick on which the next reading is requested; kNoTick: it is not known.
  void OnTick(std::int64_t tick) { output_.OnTick(tick); }
  // Publishes what is due: DEVICE and ALARM on change and at 1 Hz, and a block after 100 ms. Call at least every 100 ms.
  void Tick(MonoNs now);
  // Reports that UNIX time was stepped: the next messages have the flag CLOCK_STEPPED.
  void OnClockStepped();

  // Sets the datum: `counts` (after direction) read 0. Increments the epoch and sets REFERENCED. The same datum again
  // changes nothing. `unix_us` is when the datum was established; 0 means unknown, and is treated as long ago:
  // - A datum from before the loss of the reference does not restore the reference.
  // - If only the driver counts the turns, a datum from before the begin of the counting leaves the turns unknown.
  void SetDatum(std::int64_t counts, std::int64_t unix_us);
  // Returns the datum with which the present position reads `value` (in the unit of the axis), or nothing if no valid
  // position is known.
  [[nodiscard]] std::optional<std::int64_t> DatumFor(double value) const;

  // Deletes the datum that was set, and increments the epoch. The datum of the file is used again; without one, the axis
  // is not REFERENCED. Does nothing if no datum was set.
  void ClearDatum() { axis_.ClearDatum(); }
  // Returns what the present position would read with this datum, or nothing if no valid position is known.
  [[nodiscard]] std::optional<double> ValueWith(std::int64_t datum_counts) const {
    return axis_.ValueWith(datum_counts);
  }

  // The alarms of the device, which operators acknowledge and shelve.
  [[nodiscard]] AlarmTable& alarms() { return alarms_; }
  [[nodiscard]] const AlarmTable& alarms() const { return alarms_; }

  // The state for the driver's HELLO and for interlocks.
  struct Summary {
    std::int8_t state = 0;  // device_info_t STATE_*
    std::int32_t datum_epoch = 0;
    bool reference_lost = false;
    double value = 0;           // last valid position in unit; NaN unknown
    std::string_view identity;  // "17" or "17 SN0042"; empty: unknown; valid until the next OnIdentity
    std::optional<Reference::Datum> datum;
    std::optional<Reference::Datum> file_datum;  // of the machine's file, used or not
    struct Position {
      std::int64_t counts = 0;  // after direction, before the datum; absolute within the axis's turns mode
      std::int64_t unix_us = 0;
    };
    std::optional<Position> position;  // of the last valid reading
  };
  [[nodiscard]] Summary summary() const;
  [[nodiscard]] std::int64_t good() const { return health_.good(); }
  // Writes to memory of limited endurance.
  [[nodiscard]] std::int64_t nv_writes() const { return report_.nv_writes(); }
  [[nodiscard]] std::int64_t errors(ErrorKind kind) const { return health_.errors(kind); }

 private:
  // When a message is due that is sent once per second and on changes: DEVICE and ALARM.
  class PublishTimer {
   public:
    // `revision`: of the content of the message.
    [[nodiscard]] bool Due(std::int64_t revision, MonoNs at);

   private:
    bool sent_ = false;
    MonoNs sent_at_ = 0;
    std::int64_t sent_revision_ = 0;
  };

  void AdvanceTime(MonoNs at) { now_ = std::max(now_, at); }
  [[nodiscard]] std::int64_t NowUnixUs() const { return context_.time->Utime(now_); }
  void RaiseWhile(bool present, const AlarmSpec& alarm) {
    alarms_.Set(alarm, present ? AlarmState::kLive : AlarmState::kAbsent, NowUnixUs());
  }
  // The alarms follow from the state, and the state of health_ from the alarms.
  void UpdateAlarms();
  // Updates the alarms that end after a time.
  void UpdateTimedAlarms();
  void PublishDue();

  DevicePublisherContext context_;
  const std::string name_;
  const std::string device_channel_ = "DEVICE/" + name_;
  const std::string alarm_channel_ = "ALARM/" + name_;
  Axis axis_;
  PositionOutput output_;
  MotorOutput motor_;
  DeviceHealth health_;
  DeviceReport report_;
  AlarmTable alarms_;
  alarm_t alarm_message_{};
  PublishTimer device_timer_;
  PublishTimer alarm_timer_;
  MonoNs now_ = 0;  // the latest time of an event
  MonoNs jump_until_ = 0;
  MonoNs clock_stepped_until_ = 0;

  // The state of the axis that its alarms depend on, as of the last UpdateAlarms.
  struct AxisState {
    bool lost = false;
    bool outside = false;
    std::int32_t epoch = 0;
    std::int64_t jumps = 0;
    bool operator==(const AxisState&) const = default;
  };
  AxisState seen_axis_;
  std::int64_t axis_revision_ = 0;
  std::int64_t seen_health_ = -1;
  std::int64_t seen_alarms_ = -1;
};

}  // namespace axlecast
