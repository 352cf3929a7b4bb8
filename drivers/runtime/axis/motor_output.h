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

// Sends what a motor monitor says: MOTOR/<device> at most at the publish rate, TRIP/<device> for each trip, and
// LIMITS/<device> when a limit changed; the newest trip and the limits again every minute. Allocates nothing while
// readings go on.
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
  [[nodiscard]] std::int64_t Utime(MonoNs instant) const {
    return instant == 0 ? 0 : context_.time->Utime(instant);
  }

  Context context_;
  MonoNs period_;  // shortest between two MOTOR messages
  std::string motor_channel_;
  std::string trip_channel_;
  std::string limits_channel_;
  motor_health_t motor_{};
  trip_log_t trip_{};  // the newest
  motor_limits_t limits_{};
  std::int64_t trip_seq_ = 0;
  MonoNs motor_at_ = 0;
  MonoNs trip_at_ = kNever;    // when the newest was sent; kNever none
  MonoNs limits_at_ = kNever;  // when they were sent; kNever: none are known
};

}  // namespace axlecast
