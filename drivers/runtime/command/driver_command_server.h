#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/command/device_summary.h"
#include "core/command/signature.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "core/device/operation.h"
#include "core/messages/message.h"

namespace axlecast {

// The driver's side of the dialogue with the bridge: takes driver_command_t and permit_t, answers driver_status_t.
// Two threads use it: the command thread (On...) and the bus's thread (the rest). It locks; it never waits for the
// bus, and it verifies no signature while it holds the lock.
class DriverCommandServer {
 public:
  struct Context {
    std::int64_t boot_id = 0;
    const Clock* clock = nullptr;
    MessageSink* sink = nullptr;      // of the command port
    std::function<void()> wake;       // interrupts the bus's sleep
    const SigningKey* key = nullptr;  // signs every status; null: they stay unsigned
  };
  DriverCommandServer(const BusConfig& bus, const BridgeConfig& bridge, Context context);
  ~DriverCommandServer();

  static constexpr std::size_t kMaxWaiting = 16;       // orders per device
  static constexpr std::size_t kMaxRemembered = 4096;  // ids; the oldest finished one is forgotten first

  // Command thread. An order that the machine's file does not allow by its signature (OrderAuthority), or that cannot
  // be decoded, is counted and not answered; one for another boot is neither. Acknowledges at once; refuses what the boot id, the bridge's epoch, the device, the operation
  // or its arguments do not allow; answers queries; a repeated id is answered, never done again: not even when it
  // is no longer remembered, because an unknown id acts only with an epoch newer than every one before. So an
  // answer STATE_UNKNOWN is a promise: what was sent up to its bridge_epoch has not been done and never will be.
  // KIND_PREPARE is answered like EXECUTE, but never begins; its id can not be used for another kind.
  void OnDriverCommand(Bytes message);
  void OnPermit(const std::string& device, Bytes message);

  // Any thread: orders that were counted and not answered; whose orders count.
  [[nodiscard]] std::int64_t refused() const;
  [[nodiscard]] std::string_view Rule() const;

  // Bus's thread: the next order for any device that is not busy with one, urgent ones first and whatever the
  // device is busy with; expired ones are answered EXPIRED here.
  struct Taken {
    std::string device;
    DriverCommand order;
  };
  [[nodiscard]] std::optional<Taken> Take();
  // Ids of orders that the bridge wants cancelled and that a device holds.
  [[nodiscard]] std::optional<Taken> TakeCancel();
  // The next PREPARE, of any device, busy or not; and what EXECUTE would say to it.
  [[nodiscard]] std::optional<Taken> TakePrepare();
  void ReportPrepared(const CommandId& id, const Outcome& outcome, std::int32_t epoch_after);
  // A fresh permit names the operation, or the device's configuration says `permit: not_required`.
  [[nodiscard]] bool HasPermit(const std::string& device, const std::string& operation) const;
  // Why it has none, with what was measured.
  [[nodiscard]] std::string WhyNoPermit(const std::string& device, const std::string& operation) const;
  // How an order that was taken stands or ended. The first final outcome stands; progress is published at most
  // every 50 ms; the first four changes fit. `nv_writes`: of the device's limited memory since the order began.
  void Report(const std::string& device, const CommandId& id, const Outcome& outcome, std::int32_t epoch_after,
              std::int32_t nv_writes = 0);
  // The writes of an order that has not ended, when it will not be reported any more.
  void CountWrites(const std::string& device, const CommandId& id, std::int32_t nv_writes);

  // Once a second and on change: HELLO with the devices' summaries; GOODBYE at a clean stop.
  using DeviceSummary = axlecast::DeviceSummary;
  void Hello(std::span<const DeviceSummary> devices);
  // Once a second and on change, after an alarm of the device was acknowledged: those that are.
  void TellAcknowledged(const std::string& device, std::span<const std::string> alarms);
  // Waiting orders are answered REJECTED, those that a device holds INDETERMINATE; later ones are REJECTED.
  void Goodbye();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
