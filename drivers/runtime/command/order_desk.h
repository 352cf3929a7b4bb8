#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/family.h"
#include "drivers/runtime/core/message_sink.h"
#include "drivers/runtime/core/operation.h"

namespace axlecast {

// The driver's side of the dialogue with the bridge: takes driver_command_t and permit_t, answers driver_status_t.
// Two threads use it: the command thread (On...) and the bus's thread (the rest). It locks; it never waits for the
// bus.
class OrderDesk {
 public:
  struct Context {
    std::int64_t boot_id = 0;
    const Clock* clock = nullptr;
    MessageSink* sink = nullptr;  // of the command port
    std::function<void()> wake;   // interrupts the bus's sleep
  };
  OrderDesk(const BusConfig& bus, Context context);
  ~OrderDesk();

  static constexpr std::size_t kMaxWaiting = 16;       // orders per device
  static constexpr std::size_t kMaxRemembered = 4096;  // ids; the oldest finished one is forgotten first

  // Command thread. Acknowledges at once; refuses what the boot id, the bridge's epoch, the device, the operation
  // or its arguments do not allow; answers queries; a repeated id is answered, never done again: not even when it
  // is no longer remembered, because an unknown id acts only with an epoch newer than every one before. So an
  // answer STATE_UNKNOWN is a promise: what was sent up to its bridge_epoch has not been done and never will be.
  void OnDriverCommand(Bytes message);
  void OnPermit(const std::string& device, Bytes message);

  // Bus's thread: the next order for any device that is not busy with one, urgent ones first and whatever the
  // device is busy with; expired ones are answered EXPIRED here.
  struct Taken {
    std::string device;
    Order order;
  };
  [[nodiscard]] std::optional<Taken> Take();
  // Ids of orders that the bridge wants cancelled and that a device holds.
  [[nodiscard]] std::optional<Taken> TakeCancel();
  // A fresh permit names the operation, or the device's configuration says `permit: not_required`.
  [[nodiscard]] bool HasPermit(const std::string& device, const std::string& operation) const;
  // How an order that was taken stands or ended. The first final outcome stands; progress is published at most
  // every 50 ms; the first four changes fit.
  void Report(const std::string& device, const CommandId& id, const Outcome& outcome, std::int32_t epoch_after);

  // Once a second and on change: HELLO with the devices' summaries; GOODBYE at a clean stop.
  struct DeviceSummary {
    std::string device;
    std::int8_t state = 0;
    std::int32_t datum_epoch = 0;
    bool reference_lost = false;
    std::string identity;  // empty unknown
    struct Datum {
      std::int64_t counts = 0;  // after direction
      std::int64_t utime = 0;   // us; 0 unknown, or from the file
    };
    std::optional<Datum> datum;
    struct Position {
      std::int64_t counts = 0;  // after direction, before the datum
      std::int64_t utime = 0;   // us
    };
    std::optional<Position> position;  // of the last valid reading
  };
  void Hello(std::span<const DeviceSummary> devices);
  // Waiting orders are answered REJECTED, those that a device holds INDETERMINATE; later ones are REJECTED.
  void Goodbye();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Operations that the runtime itself gives every encoder, beside its family's own: set_datum (exactly one of
// `value` and `counts`) and, for the bridge only, mark_reference_lost. None where the family has no positions.
[[nodiscard]] std::span<const OperationSpec> RuntimeOperations(const Family& family);

}  // namespace axlecast
