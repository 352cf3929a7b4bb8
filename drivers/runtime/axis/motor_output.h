#pragma once

#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <cstdint>
#include <string>

#include "core/base/time.h"
#include "core/device/reading.h"
#include "core/messages/message.h"

namespace axlecast {

// Publishes the readings of a motor monitor: MOTOR/<device> at most at the publish rate, TRIP/<device> for each trip, and
// LIMITS/<device> when a limit changed. The newest trip and the limits are repeated every minute. Allocates nothing in
// normal operation.
class MotorOutput {
 public:
  static constexpr MonoNs kRepeat = 60 * kSecond;

  struct Context {
    std::int64_t boot_id = 0;
    const Timebase* time = nullptr;
    MessageSink* sink = nullptr;
    bool simulated = false;
    bool redecoded = false;
  };
  MotorOutput(const std::string& device, double publish_hz, Context context);

  void Take(const MotorReading& reading);
  void Take(const TripRecord& record);
  void Take(const MotorLimits& limits, MonoNs now);
  void Tick(MonoNs now);

 private:
  void SendLimits(MonoNs now);
  [[nodiscard]] std::int64_t UnixUs(MonoNs at) const { return at == 0 ? 0 : context_.time->Utime(at); }

  Context context_;
  MonoNs period_;  // minimum between two MOTOR messages
  std::string motor_channel_;
  std::string trip_channel_;
  std::string limits_channel_;
  motor_health_t motor_{};
  trip_log_t trip_{};  // the newest
  motor_limits_t limits_{};
  std::int64_t trip_seq_ = 0;
  MonoNs motor_at_ = 0;
  MonoNs trip_at_ = kNever;    // when the newest was sent; kNever: none was
  MonoNs limits_at_ = kNever;  // when they were sent; kNever: they are unknown
};

}  // namespace axlecast
