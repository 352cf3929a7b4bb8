#pragma once

#include <axlecast/driver_device_t.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/state/pending_command.h"
#include "bridge/store/durable_store.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/command/operation_check.h"
#include "core/config/machine_config.h"

namespace axlecast {

// How far a shaft went while nobody watched it, as far as its encoder can tell.
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

// What the bridge keeps of every device beyond the life of its driver: datum, reference, last position, identity,
// wear. Notices what happened in between, and gives a restarted driver back what it has forgotten. Free of I/O but
// for the store.
class AxisStateStore {
 public:
  // `tell` hears each event as well as the store.
  AxisStateStore(AxisStore& store, std::function<void(const AxisEvent&)> tell)
      : store_(store), on_event_(std::move(tell)) {}

  // What a driver's boot says of a device in its HELLO. `idle`: no command is under way or waits for it. An order
  // when it must be given something back; asked again with the next HELLO until it has it.
  [[nodiscard]] std::optional<BridgeCommand> OnHello(const DeviceConfig& device, const driver_device_t& reported,
                                                     std::int64_t boot_id, bool idle, Timestamp now);

  // Notes what must be durable before the task may touch its device; counts the wear that it may cause.
  [[nodiscard]] Result<> BeforeRoute(const DeviceConfig& device, PendingCommand& task, Timestamp now);
  // The task has its outcome: what it changed is kept, what it did not do is taken back. May add to the status.
  void OnOutcome(const DeviceConfig& device, PendingCommand& task, Timestamp now);

  // Puts the driver's operation that carries it out in the place of one of the bridge's own (OperationSpec::executed_by_bridge):
  // undo_datum gives the datum before the present one, or none; accept_exchange clears the one of the encoder that was
  // here. A reason when there is nothing to go back to.
  [[nodiscard]] Result<> Substitute(const Family& family, PendingCommand& task) const;

  // Devices of which another encoder answers than the one that their datum belongs to.
  [[nodiscard]] bool AnyExchanged() const;
  // Devices that moved further than their encoders can tell, since the last datum.
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
  void SettleWrites(PendingCommand& task, Timestamp now);
  void KeepDatum(PendingCommand& task, Timestamp now);
  void RestoreDatum(const PendingCommand& task);
  void AcceptExchange(PendingCommand& task, Timestamp now);

  AxisStore& store_;
  std::function<void(const AxisEvent&)> on_event_;
  std::map<std::string, Seen> seen_;
};

}  // namespace axlecast
