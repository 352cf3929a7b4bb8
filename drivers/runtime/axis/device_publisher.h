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

// What a channel shares with the rest of its process.
struct DevicePublisherContext {
  std::int64_t boot_id = 0;
  const Timebase* time = nullptr;
  MessageSink* sink = nullptr;
  std::function<void(const std::string& device, const CommandId& id, const Outcome& outcome)> on_outcome;
  bool redecoded = false;  // readings come from a WIRE recording
};

// One device towards LCM: samples become POSITION and POSITION_BLOCK, readings of a monitor MOTOR, TRIP and LIMITS, alarms
// ALARM, the rest DEVICE.
// Used by the bus's thread only. Allocates nothing while readings go on.
//
// OnSample counts implausible readings (ErrorKind::kImplausible) and those that the device calls invalid
// (ErrorKind::kDevice) itself: a device does not report them by OnError as well. Stray bytes are counted, but are
// no missed reading. After OnJump the datum is the file's, or none.
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

  // From the bus: the link's state; while it is down the device is OFFLINE for `reason`.
  void OnLink(bool up, std::string_view reason, MonoNs now);
  // From the bus, at least every 100 ms: publishes what is due (DEVICE and ALARM on change and at 1 Hz, a block
  // that has waited 100 ms).
  void Tick(MonoNs now);
  // UNIX time was stepped: the next message says so.
  void OnClockStepped();

  // The datum as the bridge or an operator sets it: `counts` after direction become 0. New epoch, REFERENCED; the
  // same datum again changes nothing. `utime` says when it was established. One from before the reference was lost
  // does not restore it; and where only the driver counts the turns, one from before the counting began leaves them
  // open. 0: unknown, so before everything.
  void SetDatum(std::int64_t counts, std::int64_t utime);
  // What the present position would be as datum counts so that it reads `value` (in the device's unit);
  // nothing when no valid position is known.
  [[nodiscard]] std::optional<std::int64_t> DatumFor(double value) const;

  // Takes away the datum that was set: new epoch; the file's is in force, or none, and then the axis is not
  // REFERENCED. Does nothing where none was set.
  void ClearDatum();
  // What the present position would read with this datum; nothing when no valid position is known.
  [[nodiscard]] std::optional<double> ValueWith(std::int64_t datum_counts) const;

  // For what operators say of its alarms.
  [[nodiscard]] AlarmTable& alarms();
  [[nodiscard]] const AlarmTable& alarms() const;

  // For the driver's HELLO and for interlocks.
  struct Summary {
    std::int8_t state = 0;  // device_info_t STATE_*
    std::int32_t datum_epoch = 0;
    bool reference_lost = false;
    double value = 0;  // last valid position in unit; NaN unknown
    std::string_view
        identity;  // as the device gave it, "17" or "17 SN0042"; empty unknown; until the next OnIdentity
    std::optional<Reference::Datum> datum;
    std::optional<Reference::Datum> file_datum;  // of the machine's file, in force or not
    struct Position {
      std::int64_t counts = 0;  // after direction, before the datum; absolute within the axis's turns mode
      std::int64_t utime = 0;   // us
    };
    std::optional<Position> position;  // of the last valid reading
  };
  [[nodiscard]] Summary summary() const;
  [[nodiscard]] std::int64_t good() const;
  [[nodiscard]] std::int64_t nv_writes() const;  // of the device's limited memory
  [[nodiscard]] std::int64_t errors(ErrorKind kind) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
