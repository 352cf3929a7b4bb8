#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/device.h"

namespace axlecast {

// Alarms of one device that an operator has put aside for a time. By name: a shelf may wait for its alarm.
class AlarmShelves {
 public:
  static constexpr std::int64_t kLongestUs = 24 * INT64_C(3'600'000'000);
  static constexpr std::size_t kMax = 32;  // of one device

  struct Shelf {
    std::string alarm;
    std::int64_t until_utime = 0;  // us, UNIX time
    std::uint8_t up_to = 0;        // alarm_entry_t SEVERITY_*: a worse one is not put aside
  };

  [[nodiscard]] const Shelf* Find(std::string_view alarm) const;
  [[nodiscard]] bool IsFull() const { return shelves_.size() >= kMax; }
  // In the place of the one that there is.
  void Put(Shelf shelf);
  // False when there was none.
  bool Remove(std::string_view alarm);
  // True when the time of any is over: they are gone. However the clock was set, none lasts longer than kLongestUs.
  bool Expire(std::int64_t utime);

  [[nodiscard]] bool Hides(const AlarmSpec& alarm) const;

 private:
  std::vector<Shelf> shelves_;
};

}  // namespace axlecast
