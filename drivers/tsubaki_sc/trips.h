#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/tsubaki_sc/register_map.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

// AI 200 to 204.
struct TripStatus {
  std::int32_t count = 0;
  std::int32_t motor = 0;                     // bits of the motor status
  std::array<std::int32_t, kLogs> factors{};  // newest first

  friend bool operator==(const TripStatus&, const TripStatus&) = default;
};

// Returns the number of trips between two readings of the status. If the count fell, or the factors changed under the
// same count, the count was cleared meanwhile and counts from 0.
[[nodiscard]] int TripsBetween(const TripStatus& before, const TripStatus& after);

// Detects trips in all status readings, and reads their logs. The unit shifts its logs 1 -> 2
// -> 3 at each trip. So a log counts only when a status reading after its last block shows that there was no trip
// since its first one; else it is read once more. Newest first.
class TripReader {
 public:
  explicit TripReader(DeviceOutput& output) : output_(output) {}

  // Another unit may be connected: its recorded trips are history, not new trips.
  void Forget();
  void OnStatus(const TripStatus& status, Interval at);
  void OnLogInterval(std::uint16_t tenths);
  void OnLog(const LogPlace& place, const modbus::Reply& reply, Interval at);
  // The request that Next returned has failed.
  void OnFailure(const Answer& answer);
  // Requests all logs that hold a trip.
  void RequestAll();

  [[nodiscard]] bool pending() const { return Current() < kLogs; }
  // Returns whether the next log is of a trip that the driver observed, or is requested by a command.
  [[nodiscard]] bool fresh() const { return pending() && logs_[Current()].fresh; }
  [[nodiscard]] std::size_t log() const { return Current(); }
  [[nodiscard]] Block Next() const;
  // Returns how often the newest log was begun again because of a further trip.
  [[nodiscard]] int restarts() const { return restarts_; }
  [[nodiscard]] const std::optional<TripStatus>& status() const { return status_; }

 private:
  struct Log {
    bool pending = false;
    bool fresh = false;
    std::int32_t trip_count = 0;  // 0 unknown
    MonoNs not_before = 0;        // 0 unknown
    MonoNs not_after = 0;
  };

  [[nodiscard]] std::size_t Current() const;  // kLogs: none
  [[nodiscard]] bool Complete() const { return begun_ && tried_ == kAllQuantities; }
  void Shift(std::size_t trips, const TripStatus& status, Interval at);
  void RequestHistory(const TripStatus& status, Interval at);
  void Publish(const TripStatus& status);
  void BeginAgain();

  static constexpr std::uint8_t kAllQuantities = 0x7F;

  DeviceOutput& output_;
  std::optional<TripStatus> status_;
  Interval status_at_;
  std::array<Log, kLogs> logs_{};
  std::int32_t interval_us_ = 0;
  bool interval_unknown_ = false;  // it cannot be read, or is out of range

  TripRecord record_;       // of the current log
  bool begun_ = false;      // the record holds blocks
  std::uint8_t tried_ = 0;  // bit q: quantity q was read, or cannot be read
  int failures_ = 0;        // of the same block in a row
  int restarts_ = 0;
};

}  // namespace axlecast::tsubaki_sc
