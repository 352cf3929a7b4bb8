#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/log.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "core/messages/origin.h"
#include "core/time/base_clock.h"
#include "drivers/runtime/axis/device_publisher.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/bus/bus_health.h"
#include "drivers/runtime/command/driver_command_server.h"
#include "drivers/runtime/command/operations.h"
#include "drivers/runtime/process/held_messages.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// The ports of drivers/hal that a bus uses.
struct Ports {
  std::unique_ptr<ByteLink> link;     // this one, or `frames`
  std::unique_ptr<FrameLink> frames;  // of a CAN bus
  std::unique_ptr<PulseLines> lines;  // null: the family uses no lines
  std::function<std::vector<std::string>()> warnings;
};

// Makes the ports without opening them. `clock` outlives the ports.
[[nodiscard]] Ports MakePorts(const MachineConfig& machine, const BusConfig& bus, const Clock& clock);

// Returns the settings of a configured bus. On a bus with several devices, a silent device is paused for longer while
// others answer, because its timeouts take slots from them. While no device answers, each is polled at least every 100 ms.
[[nodiscard]] BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines,
                                        const BaseClaims* base = nullptr);
// Returns the kind of bus for its recording.
[[nodiscard]] WireLog::Kind WireKindOf(const BusConfig& config);
// Returns true if the driver of this bus handles passwords.
[[nodiscard]] bool HoldsSecrets(const BusConfig& config);

// Detects that another sender sends commands that this driver refuses: at the first one, then once per 10 s.
class UnauthorizedCommandCounter {
 public:
  static constexpr MonoNs kPeriod = 10 * kSecond;

  // `refused`: commands refused since the start. Returns true if present() has changed.
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

// Detects a second driver of the same bus by its boot id on our own DRIVER_STATUS channel. Thread-safe.
class DuplicateDriverDetector {
 public:
  // A driver sends HELLO once per second. After this time without a message, it is regarded as ended.
  static constexpr MonoNs kGoneAfter = 3 * kSecond;

  DuplicateDriverDetector(std::int64_t boot_id, const Clock& clock) : boot_id_(boot_id), clock_(clock) {}

  // Takes a message on DRIVER_STATUS/<bus>, also our own. A GOODBYE of another driver is ignored.
  void OnDriverStatus(Bytes message);

  [[nodiscard]] bool Present(MonoNs now) const { return now < present_until_.load(std::memory_order_relaxed); }

 private:
  const std::int64_t boot_id_;
  const Clock& clock_;
  std::atomic<MonoNs> present_until_ = 0;
};

// Dependencies of a driver. All must outlive it.
struct DriverPorts {
  ByteLink* link = nullptr;     // this one, or `frames`, as the family requires
  FrameLink* frames = nullptr;  // of a CAN bus
  PulseLines* lines = nullptr;  // null: the family uses no lines
  SecretSource* secrets = nullptr;
  const Clock* clock = nullptr;
  MessageSink* data = nullptr;
  MessageSink* commands = nullptr;
  bool has_time_base = false;       // the machine has one: its ticks are those of the bus
  const SigningKey* key = nullptr;  // signs statuses for the bridge; null: they are unsigned
  Log log;
  std::function<std::vector<std::string>()> link_warnings;  // warnings of the last Open; may be empty
};

// Runs one bus: its devices, their publishers, and the commands of the bridge. Used by the bus's thread only, except
// command_server(), duplicates() and base_clock(), which the command thread calls.
class Driver final : private BusObserver {
 public:
  static constexpr MonoNs kTick = 100 * kMillisecond;
  static constexpr int kTicksPerHello = 10;
  // How long a command that has touched its device may continue when the driver stops.
  static constexpr MonoNs kGrace = 700 * kMillisecond;

  Driver(const BusConfig& config, const BridgeConfig& bridge, const Origin& origin, DriverPorts ports);
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;

  // Runs one step of the bus. Returns the present time, after at most 100 ms and one exchange.
  MonoNs RunOnce();

  // Ends running commands within kGrace, publishes what waits, sends GOODBYE and closes the line. A command that has not
  // ended is INDETERMINATE: the bridge then checks its effect.
  void Stop();

  [[nodiscard]] DriverCommandServer& command_server() { return command_server_; }
  // Returns the reason if this driver must end, because another process has had the line for kLineHeldFor; else an empty
  // text. While another process has the line, nothing is published.
  static constexpr MonoNs kLineHeldFor = 2 * kSecond;
  [[nodiscard]] std::string LineTaken() const;
  [[nodiscard]] DuplicateDriverDetector& duplicates() { return duplicates_; }
  // Any thread. Receives the claims of this host about the time base.
  [[nodiscard]] BaseClock& base_clock() { return base_clock_; }

 private:
  struct Unit {
    const DeviceConfig* config;
    std::unique_ptr<DevicePublisher> channel = nullptr;
    std::unique_ptr<Device> device = nullptr;
    std::int64_t acknowledged_published = 0;  // AlarmTable::acknowledged_revision
    std::int64_t late_replies = 0;            // at the last tick
    MonoNs late_until = 0;                    // end of the alarm
  };

  void OnSlot(std::size_t device, std::int64_t tick) override;
  void OnWait() override { held_.Release(); }
  void OnLink(bool up, std::string_view reason, MonoNs now) override;
  // Not inlined, so that RunOnce can wipe what it leaves on the stack.
  [[gnu::noinline]] void RunStep();
  void Tick();
  void FlushBlocks();
  void FollowUtc();
  void WatchDuplicates();
  void WatchUnauthorized();
  void WatchLateReplies();
  // Returns true if the state of the bus or its alarms have changed.
  [[nodiscard]] bool WatchCan();
  void RaiseForAll(const AlarmSpec& alarm, bool present);
  void PublishHello();
  void PublishAcknowledged(bool second);
  void ReportHealth();
  [[nodiscard]] bool SummaryChanged() const;
  [[nodiscard]] Bus MakeBus();
  [[nodiscard]] MessageSink* SinkOfReadings();
  [[nodiscard]] Link& link() const;
  // Returns the claims about the base of this bus's ticks; null if the base is CLOCK_MONOTONIC of this host.
  [[nodiscard]] const BaseClaims* Base() const { return ports_.has_time_base ? &base_clock_ : nullptr; }

  const BusConfig& config_;
  const DriverPorts ports_;
  Timebase time_;
  BaseClock base_clock_;
  DuplicateDriverDetector duplicates_;
  DriverCommandServer command_server_;
  UnauthorizedCommandCounter unauthorized_;
  Operations operations_;
  std::unique_ptr<WireLog> wire_;
  HeldMessages held_;  // of the devices, where requests follow each other directly
  Bus bus_;
  BusHealth health_;
  const bool holds_secrets_;
  std::optional<CanWatch> can_watch_;  // of a CAN bus
  std::vector<Unit> units_;
  std::vector<DeviceTally> tallies_;
  std::vector<driver_device_t> summaries_;  // as in the last HELLO
  MonoNs now_;
  MonoNs next_tick_;
  int ticks_ = 0;
  bool duplicate_seen_ = false;
  bool line_tried_ = false;
  std::string line_held_;  // the reason, while another process has the line
  MonoNs held_since_ = 0;
};

// Receives the command port of a driver on its own thread, so that a command is acknowledged at once, even if the bus is
// busy. The port and the driver outlive it.
class CommandThread {
 public:
  CommandThread(LcmPort& port, const BusConfig& config, Driver& driver);
  ~CommandThread();
  CommandThread(const CommandThread&) = delete;
  CommandThread& operator=(const CommandThread&) = delete;

  // Returns true if the port no longer delivers messages: the driver receives no commands, and should be restarted.
  [[nodiscard]] bool failed() const { return failed_; }

 private:
  void Run();

  LcmPort& port_;
  std::atomic<bool> ending_ = false;
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

}  // namespace axlecast
