#pragma once

#include <algorithm>
#include <array>
#include <bit>
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
  void Forget() {
    status_.reset();
    logs_ = {};
    interval_us_ = 0;
    interval_unknown_ = false;
    BeginAgain();
  }
  void OnStatus(const TripStatus& status, Interval at) {
    if (!status_) {
      RequestHistory(status, at);
    } else if (const int trips = TripsBetween(*status_, status); trips > 0) {
      Shift(static_cast<std::size_t>(trips), status, at);
    } else if (Complete()) {
      Publish(status);
    }
    status_ = status;
    status_at_ = at;
  }
  void OnLogInterval(std::uint16_t tenths) {
    constexpr std::int32_t kTenth = 100'000;  // us
    constexpr std::uint16_t kLongest = 100;   // guideline 11: 1 to 100
    const bool possible = tenths >= 1 && tenths <= kLongest;
    interval_us_ = possible ? tenths * kTenth : 0;
    interval_unknown_ = !possible;
  }
  void OnLog(const LogPlace& place, const modbus::Reply& reply, Interval at) {
    if (!pending() || place.log != Current()) return;
    if (!begun_) record_ = {.at = at};
    begun_ = true;
    record_.at.last = at.last;
    for (std::size_t i = 0; i < kLogSamples; ++i) {
      record_.samples[place.quantity][i] =
          static_cast<float>(ToUnits(kQuantityTable[place.quantity], reply.Register(i)));
    }
    const auto bit = static_cast<std::uint8_t>(1U << place.quantity);
    record_.valid_mask |= bit;
    tried_ |= bit;
    failures_ = 0;
  }
  // The request that Next returned has failed.
  void OnFailure(const Answer& answer) {
    if (!answer.block) return;
    if (MayRepeat(answer, failures_)) return;
    failures_ = 0;
    if (*answer.block == kLogInterval) interval_unknown_ = true;
    const auto place = LogPlaceOf(*answer.block);
    if (!place || place->log != Current()) return;
    if (!begun_) record_ = {.at = answer.at};
    begun_ = true;
    tried_ |= static_cast<std::uint8_t>(1U << place->quantity);
  }
  // Requests all logs that hold a trip.
  void RequestAll() {
    if (!status_) return;
    for (std::size_t i = 0; i < kLogs; ++i) {
      const bool recorded = status_->factors[i] != 0 || status_->count > static_cast<std::int32_t>(i);
      if (!recorded) continue;
      if (logs_[i].not_after == 0) {  // recorded before the count was cleared, or never seen
        logs_[i].trip_count = std::max(status_->count - static_cast<std::int32_t>(i), 0);
        logs_[i].not_after = status_at_.last;
      }
      logs_[i].pending = true;
      logs_[i].fresh = true;
    }
    BeginAgain();
    restarts_ = 0;
  }

  [[nodiscard]] bool pending() const { return Current() < kLogs; }
  // Returns whether the next log is of a trip that the driver observed, or is requested by a command.
  [[nodiscard]] bool fresh() const { return pending() && logs_[Current()].fresh; }
  [[nodiscard]] std::size_t log() const { return Current(); }
  [[nodiscard]] Block Next() const {
    if (interval_us_ == 0 && !interval_unknown_) return kLogInterval;
    if (tried_ == kAllQuantities) return kStatus;
    return LogBlock(Current(), static_cast<std::size_t>(std::countr_one(tried_)));
  }
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

  [[nodiscard]] std::size_t Current() const {
    const auto found = std::find_if(logs_.begin(), logs_.end(), [](const Log& log) { return log.pending; });
    return static_cast<std::size_t>(found - logs_.begin());
  }  // kLogs: none
  [[nodiscard]] bool Complete() const { return begun_ && tried_ == kAllQuantities; }
  void Shift(std::size_t trips, const TripStatus& status, Interval at) {
    if (begun_) {
      ++restarts_;
      BeginAgain();
    }
    const std::size_t added = std::min(trips, kLogs);
    std::shift_right(logs_.begin(), logs_.end(), static_cast<std::ptrdiff_t>(added));
    for (std::size_t i = 0; i < added; ++i) {
      logs_[i] = {.pending = true,
                  .fresh = true,
                  .trip_count = status.count - static_cast<std::int32_t>(i),
                  .not_before = status_at_.first,
                  .not_after = at.last};
    }
  }
  // The trips that are recorded at the start happened before it. Factors and logs outlive a clear of the count.
  void RequestHistory(const TripStatus& status, Interval at) {
    for (std::size_t i = 0; i < kLogs; ++i) {
      const std::int32_t count = status.count - static_cast<std::int32_t>(i);
      logs_[i] = {.pending = status.factors[i] != 0,
                  .fresh = false,
                  .trip_count = std::max(count, 0),
                  .not_before = 0,
                  .not_after = at.last};
    }
  }
  void Publish(const TripStatus& status) {
    const std::size_t index = Current();
    Log& log = logs_[index];
    record_.log_index = static_cast<std::int8_t>(index + 1);
    record_.trip_count = log.trip_count;
    record_.factor_bits = status.factors[index];
    record_.not_before = log.not_before;
    record_.not_after = log.not_after;
    record_.interval_us = interval_us_;
    for (std::size_t q = 0; q < kQuantities; ++q) {
      if ((record_.valid_mask >> q & 1U) == 0) record_.samples[q].fill(kUnknownQuantity);
    }
    log.pending = false;
    log.fresh = false;
    if (!pending()) restarts_ = 0;
    BeginAgain();
    if (record_.valid_mask != 0) output_.OnTrip(record_);
  }
  void BeginAgain() {
    begun_ = false;
    tried_ = 0;
    failures_ = 0;
  }

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
