#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/log.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/bus/bus_health.h"
#include "drivers/runtime/command/driver_command_server.h"
#include "drivers/runtime/command/operations.h"

namespace axlecast {

// Whether somebody sends orders that this driver refuses: at once with the first one, then judged every 10 s.
class UnauthorizedCommandCounter {
 public:
  static constexpr MonoNs kPeriod = 10 * kSecond;

  // `refused`: orders refused since the start. True when present() has changed.
  bool Update(std::int64_t refused, MonoNs now) {
    if (now < next_) return false;
    const bool was = present_;
    present_ = refused != seen_;
    seen_ = refused;
    if (present_ || was) next_ = now + kPeriod;
    return present_ != was;
  }
  [[nodiscard]] bool present() const { return present_; }

 private:
  std::int64_t seen_ = 0;
  bool present_ = false;
  MonoNs next_ = 0;
};

// Notices a second driver of the same bus by its boot id on our own DRIVER_STATUS channel. Thread-safe.
class DuplicateDriverDetector {
 public:
  // A driver says HELLO once a second: one that has been quiet for longer is gone.
  static constexpr MonoNs kGoneAfter = 3 * kSecond;

  DuplicateDriverDetector(std::int64_t boot_id, const Clock& clock) : boot_id_(boot_id), clock_(clock) {}

  // A message on DRIVER_STATUS/<bus>, ours among them. A GOODBYE of another is none.
  void OnDriverStatus(Bytes message);

  [[nodiscard]] bool Present(MonoNs now) const { return now < present_until_.load(std::memory_order_relaxed); }

 private:
  const std::int64_t boot_id_;
  const Clock& clock_;
  std::atomic<MonoNs> present_until_ = 0;
};

// What a driver stands on. All of it outlives the driver.
struct DriverPorts {
  ByteLink* link = nullptr;     // one of these two, as the family's link is
  FrameLink* frames = nullptr;  // of a CAN bus
  PulseLines* lines = nullptr;  // null: the family uses none
  SecretSource* secrets = nullptr;
  const Clock* clock = nullptr;
  MessageSink* data = nullptr;
  MessageSink* commands = nullptr;
  const SigningKey* key = nullptr;  // signs what the bridge is told; null: it stays unsigned
  Log log;
  std::function<std::vector<std::string>()> link_warnings;  // what the last Open found wanting; may be empty
};

// One bus, its devices and their channels, and what the bridge orders of them. The bus's thread only, except desk()
// and duplicates(), which the command thread feeds.
class Driver final : private LinkObserver {
 public:
  static constexpr MonoNs kTick = 100 * kMillisecond;
  static constexpr int kTicksPerHello = 10;
  // How long an order that has touched its device may go on when the driver is to stop.
  static constexpr MonoNs kGrace = 700 * kMillisecond;

  Driver(const BusConfig& config, const BridgeConfig& bridge, std::int64_t boot_id, DriverPorts ports);
  ~Driver() override;
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  // Gets on by one step of the bus. Returns within 100 ms and one exchange; the present instant.
  MonoNs RunOnce();

  // Ends what is under way within kGrace, publishes what waits, says GOODBYE and closes the line. An order that
  // could not end is INDETERMINATE: the bridge then looks what it did.
  void Stop();

  [[nodiscard]] DriverCommandServer& desk() { return desk_; }
  // Why this driver must end: another process has had the line for kLineHeldFor. Empty else. While another process has
  // the line, nothing is published.
  static constexpr MonoNs kLineHeldFor = 2 * kSecond;
  [[nodiscard]] std::string LineTaken() const;
  [[nodiscard]] DuplicateDriverDetector& duplicates() { return duplicates_; }

 private:
  struct Unit {
    const DeviceConfig* config;
    std::unique_ptr<DevicePublisher> channel = nullptr;
    std::unique_ptr<Device> device = nullptr;
    std::int64_t acknowledged_told = 0;  // AlarmTable::acknowledged_revision
    std::int64_t late_replies = 0;       // by the last tick
    MonoNs late_until = 0;               // the alarm stays
  };

  void OnLink(bool up, std::string_view reason, MonoNs now) override;
  // Not inlined: RunOnce can then wipe all that it left on the stack.
  [[gnu::noinline]] void TakeTurn();
  void Tick();
  void FlushBlocks();
  void FollowUtc();
  void WatchDuplicates();
  void WatchOrders();
  void WatchLateReplies();
  // True when the bus's state or its alarms have changed.
  [[nodiscard]] bool WatchCan();
  void TellAll(const AlarmSpec& alarm, bool present);
  void SayHello();
  void TellAcknowledged(bool second);
  void ReportHealth();
  [[nodiscard]] bool SummaryChanged() const;
  [[nodiscard]] DevicePublisherContext MakeChannelContext();
  [[nodiscard]] Bus MakeBus();
  [[nodiscard]] Link& link() const;

  const BusConfig& config_;
  const std::int64_t boot_id_;
  const DriverPorts ports_;
  Timebase time_;
  DuplicateDriverDetector duplicates_;
  DriverCommandServer desk_;
  UnauthorizedCommandCounter foreign_;
  Operations operations_;
  std::unique_ptr<WireLog> wire_;
  Bus bus_;
  BusHealth health_;
  const bool holds_secrets_;
  std::optional<CanWatch> can_watch_;  // of a CAN bus
  std::vector<Unit> units_;
  std::vector<DeviceTally> tallies_;
  std::vector<DriverCommandServer::DeviceSummary> summaries_;  // as the last HELLO said
  MonoNs now_;
  MonoNs next_tick_;
  int ticks_ = 0;
  bool duplicate_seen_ = false;
  bool line_tried_ = false;
  std::string line_held_;  // the cause, while another process has the line
  MonoNs held_since_ = 0;
};

}  // namespace axlecast
