#pragma once

#include <optional>
#include <string_view>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "core/device/reading.h"
#include "core/device/step.h"

namespace axlecast {

// Motion of the shaft according to the last readings.
struct Motion {
  bool known = false;       // there are enough recent valid readings
  bool standstill = false;  // within the standstill tolerance over the whole window
  double speed_rpm = 0;     // maximum speed in the window
  std::int64_t counts = 0;  // last valid absolute counts, before direction and datum
  MonoNs at = 0;            // time of that reading
};

// An alarm that a device can report. Names and actions are the manufacturer's.
struct AlarmSpec {
  std::int32_t code;
  std::uint8_t source;    // alarm_entry_t SOURCE_*
  std::uint8_t severity;  // alarm_entry_t SEVERITY_*
  const char* name;       // <= 24 bytes
  const char* action;     // <= 80 bytes
};
enum class AlarmState : std::uint8_t { kAbsent, kLive, kDeviceLatched, kDriverLatched };

// Receives everything that a device reports. Implemented by the runtime's DevicePublisher.
class DeviceOutput {
 public:
  virtual ~DeviceOutput() = default;

  virtual void OnSample(const Sample& sample) = 0;        // a reading whose position was decoded
  virtual void OnMotor(const MotorReading& reading) = 0;  // a reading of a motor monitor
  virtual void OnTrip(const TripRecord& record) = 0;      // a trip whose curves were read
  virtual void OnMotorLimits(const MotorLimits&) {}       // limits of a motor monitor were read, changed or not
  virtual void OnError(ErrorKind kind, Interval at) = 0;  // a reading failed
  virtual void OnAlarm(const AlarmSpec& alarm, AlarmState state, MonoNs now) = 0;
  virtual void OnIdentity(std::int64_t identity, std::string_view serial, std::string_view firmware) = 0;
  virtual void OnProductCode(std::string_view) {}        // of the manufacturer, if the device reports it
  virtual void OnStarting(std::string_view reason) = 0;  // powered on, not yet able to answer
  virtual void OnRefused(std::string_view reason) = 0;   // answers, but must not be trusted (wrong identity)
  virtual void OnNonVolatileWrite() = 0;                 // one write of the device's limited memory
  virtual void OnReferenceLost() = 0;                    // the turns are not reliable until OnReferenceRestored
  virtual void OnReferenceRestored() = 0;
  virtual void OnJump() = 0;                        // the position jumped without motion: new epoch
  virtual void OnDatumChanging(bool changing) = 0;  // a command that moves the datum is under way
  virtual void OnOutcome(const CommandId& id, const Outcome& outcome) = 0;

  [[nodiscard]] virtual Motion MotionAt(MonoNs now) const = 0;
};

// Requests of the bus whose replies are missing and may still arrive late.
class PendingReplies {
 public:
  virtual ~PendingReplies() = default;
  // Returns the time from which no late reply can be mistaken for the reply to this exchange. If it is not after `now`, the
  // exchange may be sent.
  [[nodiscard]] virtual MonoNs FreeAt(const Exchange& exchange, MonoNs now) const = 0;
};

// The state of the bus when a device is polled for its next step.
struct BusSlot {
  MonoNs now = 0;
  bool poll_due = false;  // the next live reading of the device is due
  // This slot is reserved for readings: a command that can wait must wait. If a command must not be interrupted, the device
  // returns the command's step.
  bool reserved = false;
  const PendingReplies* pending = nullptr;

  // Returns whether the exchange may be sent now. Otherwise the bus delays it, unless the device requests a reply of another
  // shape.
  [[nodiscard]] bool MaySend(const Exchange& exchange) const {
    return pending == nullptr || pending->FreeAt(exchange, now) <= now;
  }
};

// The logic of one device, without I/O and clocks: Next returns the step that the device requests, and On receives the
// events. One thread calls all functions. Nothing is allocated during normal readings.
class Device {
 public:
  virtual ~Device() = default;

  // Returns the step that the device requests now. A live reading is requested only when its slot is due; commands and
  // recovery at any time. The bus may call it again, or poll another device first.
  [[nodiscard]] virtual Step Next(const BusSlot& slot) const = 0;

  // `step`, as Next returned it, is about to be executed.
  virtual void OnStarted(const Step& step, MonoNs now) = 0;

  // Receives the result of the device's own step, and every link change and unexpected byte of the bus.
  virtual void On(const Event& event) = 0;

  // Returns why the command could not begin now, as an error with a command_status_t REASON_*. Checks the values of its
  // arguments too. Its operation is one that the family declares. Changes nothing.
  [[nodiscard]] virtual Result<> Validate(const DriverCommand& command, MonoNs now) const = 0;
  // Begins a command whose operation the family declares and whose argument names fit. Reports its outcomes through
  // DeviceOutput::OnOutcome; if Validate fails, the final outcome is reported at once. The caller begins one command at a
  // time and waits for its final outcome. Only a command of an urgent operation may begin before that, and goes first.
  virtual void Begin(const DriverCommand& command, MonoNs now) = 0;
  // Cancels a command that has not changed the device yet. Returns false if it may have.
  [[nodiscard]] virtual bool Cancel(const CommandId& id, MonoNs now) = 0;
};

}  // namespace axlecast
