#pragma once

#include <axlecast/driver_device_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "bridge/state/command_store.h"
#include "bridge/store/durable_store.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// How far a shaft moved while no driver read its encoder, as far as the encoder can distinguish.
struct ShaftTravel {
  enum class Verdict : std::uint8_t {
    kResting,       // within what two readings at rest may differ
    kWithinWindow,  // less than a quarter of what the turns counter can hold: the figure can be trusted
    kBeyondWindow,  // more: it may as well have gone the other way round, or round several times
    kTurnsUnknown,  // a single-turn encoder: any number of whole turns may come on top
  };
  Verdict verdict = Verdict::kResting;
  std::int64_t counts = 0;  // the shortest way from `before` to `after`
  double turns = 0;
};

// `before` and `after`: counts after direction, before the datum, of an axis with these settings.
[[nodiscard]] ShaftTravel Travelled(const DeviceConfig& device, std::int64_t before, std::int64_t after);

// "moved by 3.2000 turns within 65536 turns in 12 s while its driver was away"
[[nodiscard]] std::string TravelText(const ShaftTravel& travel, const DeviceConfig& device, std::int64_t away_us);

// Keeps datum, reference, last position, identity and wear of every device beyond the life of its driver. Detects what
// changed in between, and returns the values to a restarted driver. The store is its only I/O.
class AxisStateStore {
 public:
  // `on_event` receives each event that the store receives.
  AxisStateStore(DeviceRecords& store, std::function<void(const AxisEvent&)> on_event)
      : store_(store), on_event_(std::move(on_event)) {}

  // Processes a device in a HELLO. `idle`: no command is in progress or waits for it. Returns a command if the driver must
  // get a value back. It is returned again with each HELLO until the driver has the value.
  [[nodiscard]] std::optional<BridgeCommand> OnHello(const DeviceConfig& device, const driver_device_t& reported,
                                                     std::int64_t boot_id, bool idle, Timestamp now);

  // Stores what must be durable before the command is sent, and counts the maximum wear that it may cause.
  [[nodiscard]] Result<> BeforeRoute(const DeviceConfig& device, PendingCommand& pending, Timestamp now);
  // Stores what a finished command changed, and reverts what it did not do. May add to its status.
  void OnOutcome(const DeviceConfig& device, PendingCommand& pending, Timestamp now);

  // Replaces an operation of the bridge (OperationSpec::executed_by_bridge) by the driver's operation that does it.
  // undo_datum sets the datum before the present one, or none. accept_exchange clears the datum of the previous encoder.
  // Returns an error if there is no earlier datum.
  [[nodiscard]] Result<> Substitute(const Family& family, PendingCommand& pending) const;

  // Returns whether any device answers with another encoder than the one of its datum.
  [[nodiscard]] bool AnyExchanged() const;
  // Returns whether any device moved further since its last datum than its encoder can distinguish.
  [[nodiscard]] bool AnyDoubtful() const;

 private:
  // What this life of the bridge has seen of a device.
  struct Seen {
    std::int64_t boot = 0;  // of its driver
    bool compared = false;  // its place after the start was compared
    bool reported_lost = false;
    bool restored = false;  // this boot has had a datum
    bool exchanged = false;
    bool doubtful = false;
    std::string identity;
  };

  [[nodiscard]] Result<BridgeCommand> UndoDatum(const std::string& device) const;
  void Note(const std::string& device, const char* kind, std::string text, Timestamp now);
  void CompareAfterRestart(const DeviceConfig& device, const driver_device_t& reported, const AxisRecord& record,
                           Seen& seen, Timestamp now);
  [[nodiscard]] bool UpdateReference(const std::string& device, const driver_device_t& reported, bool was_lost,
                                     Seen& seen, Timestamp now);
  void SettleWrites(PendingCommand& pending, Timestamp now);
  void KeepDatum(PendingCommand& pending, Timestamp now);
  void RestoreDatum(const PendingCommand& pending);
  void AcceptExchange(PendingCommand& pending, Timestamp now);

  DeviceRecords& store_;
  std::function<void(const AxisEvent&)> on_event_;
  std::map<std::string, Seen> seen_;
};

// Keeps acknowledgements and shelvings of alarms beyond the life of the driver. Returns them to a restarted driver, and
// removes those that have ended. Free of I/O but for the store.
class AlarmStateStore {
 public:
  explicit AlarmStateStore(DeviceRecords& store) : store_(store) {}

  // A driver's boot is there. An order when it must be given something back; asked again until it has it all.
  [[nodiscard]] std::optional<BridgeCommand> OnHello(const std::string& device, std::int64_t boot_id,
                                                     Timestamp now);
  // Refuses to shelve one more alarm than a driver takes. A driver that has restarted does not know its shelves yet.
  [[nodiscard]] Result<> BeforeRoute(const PendingCommand& pending, Timestamp now) const;
  // KIND_ACKNOWLEDGED: an alarm that this boot knew as acknowledged and names no more has gone.
  void OnAcknowledged(const driver_status_t& status);
  // The command has its outcome. May add to the status.
  void OnOutcome(PendingCommand& pending);

 private:
  [[nodiscard]] bool HasRoomFor(const std::string& device, const std::string& alarm, std::int64_t utime) const;
  void Keep(PendingCommand& pending, AlarmMark::Kind kind);
  void Restored(const PendingCommand& pending);

  DeviceRecords& store_;
};

}  // namespace axlecast
