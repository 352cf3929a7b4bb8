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

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/can.h"
#include "core/device/device.h"
#include "core/device/reading.h"
#include "core/messages/message.h"
#include "drivers/runtime/bus/bus.h"

namespace axlecast {

// A CAN bus as BUS/<bus> tells it beside what it tells of every bus.
struct CanHealth {
  int tec = -1;  // -1: not told, or not CAN
  int rec = -1;
  const AlarmSpec* worst = nullptr;  // of the alarms present, the one that explains most; null: none
  std::string_view trouble;          // that alarm in words, with what to do about it on this machine
};

// Judges successive states of a CAN controller: which alarms of the bus are present (runtime_alarms.h), and what the
// operator can do. An alarm stays for 5 s after its last sign, so that one that flickers can be read.
class CanWatch {
 public:
  static constexpr MonoNs kHold = 5 * kSecond;
  // So many errors of the protocol within a second are more than a disturbance now and then.
  static constexpr std::int64_t kManyErrors = 10;

  // `bitrate` as configured; 0: not.
  CanWatch(std::string_view interface, std::int64_t bitrate) : interface_(interface), bitrate_(bitrate) {}

  // How the controller stands, asked for every 100 ms. Counts may begin anew: the link was opened again.
  void Update(const CanController& controller, MonoNs now);

  struct Alarm {
    const AlarmSpec* spec = nullptr;
    bool present = false;
  };
  // All there are, the one that explains most first.
  [[nodiscard]] std::span<const Alarm> alarms() const { return alarms_; }
  [[nodiscard]] CanHealth health() const {
    return {.tec = controller_.tec, .rec = controller_.rec, .worst = worst_, .trouble = trouble_};
  }
  // Increments when an alarm comes or goes, and when the controller's state changes.
  [[nodiscard]] std::int64_t revision() const { return revision_; }

 private:
  // In the order of their power to explain the others.
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

  void Raise(Kind kind, bool sign) {
    if (sign) until_[kind] = now_ + kHold;
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
  std::array<Alarm, kKinds> alarms_ = Specs();
  std::array<ErrorCount, kSnapshots> errors_{};  // a ring
  std::size_t snapshots_ = 0;
  std::int64_t error_total_ = 0;
  std::int64_t errors_per_second_ = 0;
  const AlarmSpec* worst_ = nullptr;
  std::string trouble_;
  std::int64_t revision_ = 0;

  [[nodiscard]] static std::array<Alarm, kKinds> Specs();
};

// Readings of one device since the driver started.
struct DeviceTally {
  std::string_view device;
  std::int64_t good = 0;
  std::array<std::int64_t, kErrorKinds> errors{};
};

// The bus towards LCM: bus_health_t on "BUS/<bus>" and exchange_times_t on "BUS_TIMES/<bus>", to be called once a second,
// and when a CAN bus's state changes.
//
// DEGRADED: the line is open, but in this window more than 1 % of the readings failed, or every one; or a CAN bus has
// an alarm of severity WARNING or above.
class BusHealth {
 public:
  BusHealth(const BusConfig& config, std::int64_t boot_id, const Timebase& time, MessageSink& sink);

  // `can` of a CAN bus, else as it is.
  void Publish(MonoNs now, Bus& bus, std::span<const DeviceTally> devices, const CanHealth& can = {});

  // Exchanges a second that the wire's timing allows with these devices, each having its turn; 0 unknown.
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
