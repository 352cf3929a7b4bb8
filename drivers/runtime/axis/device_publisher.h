#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "core/messages/message.h"
#include "drivers/runtime/axis/axis.h"

namespace axlecast {

// What a DevicePublisher shares with the rest of its process.
struct DevicePublisherContext {
  std::int64_t boot_id = 0;
  const Timebase* time = nullptr;
  MessageSink* sink = nullptr;
  std::function<void(const std::string& device, const CommandId& id, const Outcome& outcome)> on_outcome;
  bool redecoded = false;  // readings come from a WIRE recording
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
  ~DevicePublisher() override;

  void OnSample(const Sample& sample) override;
  void OnMotor(const MotorReading& reading) override;
  void OnTrip(const TripRecord& record) override;
  void OnMotorLimits(const MotorLimits& limits) override;
  void OnProductCode(std::string_view code) override;
  void OnError(ErrorKind kind, Interval at) override;
  void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) override;
  void OnIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) override;
  void OnStarting(std::string_view reason) override;
  void OnRefused(std::string_view reason) override;
  void OnNonVolatileWrite() override;
  void OnReferenceLost() override;
  void OnReferenceRestored() override;
  void OnJump() override;
  void OnDatumChanging(bool changing) override;
  void OnOutcome(const CommandId& id, const Outcome& outcome) override;
  [[nodiscard]] Motion MotionAt(MonoNs now) const override;

  // Sets the state of the link. While the link is down, the device is OFFLINE for `reason`.
  void OnLink(bool up, std::string_view reason, MonoNs now);
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
  void ClearDatum();
  // Returns what the present position would read with this datum, or nothing if no valid position is known.
  [[nodiscard]] std::optional<double> ValueWith(std::int64_t datum_counts) const;

  // The alarms of the device, which operators acknowledge and shelve.
  [[nodiscard]] AlarmTable& alarms();
  [[nodiscard]] const AlarmTable& alarms() const;

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
  [[nodiscard]] std::int64_t good() const;
  [[nodiscard]] std::int64_t nv_writes() const;  // writes to memory of limited endurance
  [[nodiscard]] std::int64_t errors(ErrorKind kind) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
