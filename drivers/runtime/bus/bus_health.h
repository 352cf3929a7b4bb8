#pragma once

#include <array>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/alarm/alarm_codes.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "drivers/runtime/bus/bus.h"

namespace axlecast {

// What BUS/<bus> contains for a CAN bus in addition.
struct CanHealth {
  int tec = -1;  // -1: unknown, or not CAN
  int rec = -1;
  const AlarmSpec* worst = nullptr;  // the present alarm that explains most; null: no alarm is present
  std::string_view trouble;          // the text of this alarm, with what to do on this machine
};

// Determines the alarms of a CAN bus (alarm_codes.h) from successive states of its controller, and what the operator can
// do. An alarm stays for 5 s after its cause was last seen, so that an alarm that flickers can be read.
class CanWatch {
 public:
  static constexpr MonoNs kHold = 5 * kSecond;
  // Fewer protocol errors per second are regarded as occasional disturbances.
  static constexpr std::int64_t kManyErrors = 10;

  // `bitrate`: as configured; 0: not configured.
  CanWatch(std::string_view interface, std::int64_t bitrate) : interface_(interface), bitrate_(bitrate) {}

  // Takes the state of the controller, every 100 ms. The counts may restart when the link is opened again.
  void Update(const CanController& controller, MonoNs now);

  struct Alarm {
    const AlarmSpec* spec = nullptr;
    bool present = false;
  };
  // Returns all alarms, present or not. The alarm that explains most is first.
  [[nodiscard]] std::span<const Alarm> alarms() const { return alarms_; }
  [[nodiscard]] CanHealth health() const {
    return {.tec = controller_.tec, .rec = controller_.rec, .worst = worst_, .trouble = trouble_};
  }
  // Increments when an alarm comes or goes, and when the controller's state changes.
  [[nodiscard]] std::int64_t revision() const { return revision_; }

 private:
  // Each kind can explain the kinds that follow.
  enum Kind : std::uint8_t {
    kBusOff,
    kUnacknowledged,
    kQueueFull,
    kBusErrors,
    kErrorPassive,
    kFramesLost,
    kErrorWarning,
    kKinds,
  };
  struct ErrorCount {
    MonoNs at = 0;
    std::int64_t total = 0;
  };
  static constexpr std::size_t kSnapshots = 10;  // a second of them

  void Raise(Kind kind, bool seen) {
    if (seen) until_[kind] = now_ + kHold;
  }
  [[nodiscard]] bool Held(Kind kind) const { return now_ < until_[kind]; }
  [[nodiscard]] bool Present(Kind kind) const;
  [[nodiscard]] bool NobodyAnswers(const CanController& before) const;
  void CountErrors(std::int64_t more);
  void Explain();
  [[nodiscard]] std::string Cause(Kind kind) const;
  [[nodiscard]] std::string BusOffText() const;
  [[nodiscard]] std::string UnacknowledgedText() const;
  [[nodiscard]] std::string StateText(CanController::State state, std::string_view name) const;
  [[nodiscard]] std::string LostText() const;
  [[nodiscard]] std::string Rate() const;

  std::string interface_;
  std::int64_t bitrate_;
  CanController controller_;
  MonoNs now_ = 0;
  std::array<MonoNs, kKinds> until_{};
  std::array<Alarm, kKinds> alarms_{{{&runtime_alarms::kCanBusOff},
                                     {&runtime_alarms::kCanUnacknowledged},
                                     {&runtime_alarms::kCanQueueFull},
                                     {&runtime_alarms::kCanBusErrors},
                                     {&runtime_alarms::kCanErrorPassive},
                                     {&runtime_alarms::kCanFramesLost},
                                     {&runtime_alarms::kCanErrorWarning}}};
  std::array<ErrorCount, kSnapshots> errors_{};  // a ring
  std::size_t snapshots_ = 0;
  std::int64_t error_total_ = 0;
  std::int64_t errors_per_second_ = 0;
  const AlarmSpec* worst_ = nullptr;
  std::string trouble_;
  std::int64_t revision_ = 0;
};

// The readings of one device since the driver started.
struct DeviceTally {
  std::string_view device;
  std::int64_t good = 0;
  std::array<std::int64_t, kErrorKinds> errors{};
};

// Publishes bus_health_t on "BUS/<bus>" and exchange_times_t on "BUS_TIMES/<bus>".
//
// DEGRADED: the line is open, but more than 1 % of the readings of this window failed, or a CAN bus has an alarm of
// severity WARNING or above.
class BusHealth {
 public:
  BusHealth(const BusConfig& config, const Origin& origin, const Timebase& time, MessageSink& sink);

  // Call it once per second, and when the state of a CAN bus changes. `can`: for a CAN bus only.
  void Publish(MonoNs now, Bus& bus, std::span<const DeviceTally> devices, const CanHealth& can = {});

  // Returns the exchanges per second that the timing of the wire allows with these devices in turn; 0: unknown.
  [[nodiscard]] static double WireLimit(const BusConfig& config);

 private:
  void Count(const Bus& bus, std::span<const DeviceTally> devices);
  void Rates(MonoNs now, Bus& bus);
  void TakeCan(const Bus& bus, const CanHealth& can);
  void PublishTimes(const Bus& bus);
  void LastError(MonoNs now, const Bus& bus, std::span<const DeviceTally> devices, std::string_view can_trouble);

  const Timebase& time_;
  MessageSink& sink_;
  std::string channel_;
  bus_health_t message_;
  bus_health_t previous_;
  std::string times_channel_;
  exchange_times_t times_;
  double wire_limit_hz_;
  MonoNs window_start_ = 0;
  std::string seen_problem_;
  std::vector<DeviceTally> seen_;
};

}  // namespace axlecast
