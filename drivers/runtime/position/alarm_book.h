#pragma once

#include <axlecast/alarm_t.hpp>
#include <cstdint>
#include <vector>

#include "drivers/runtime/core/device.h"

namespace axlecast {

// The alarms of one device. Told again what it knows, it allocates nothing and changes no revision.
class AlarmBook {
 public:
  AlarmBook() { entries_.reserve(kExpected); }

  void Set(const AlarmSpec& alarm, AlarmState state, std::int64_t utime);
  // While offline, nobody can tell how the device's own alarms stand: they become UNKNOWN, none is cleared. What
  // the device says after that counts again; back online, its other alarms stand as it last said.
  void SetOffline(bool offline);

  [[nodiscard]] std::int64_t revision() const { return revision_; }
  // The worst alarm there is whose severity is at least `severity`; null when there is none.
  [[nodiscard]] const AlarmSpec* Worst(std::uint8_t severity) const;

  // Fills in revision, total, n and entries: worst first, then the newest. Always of the same message: strings are
  // written only where the revision has changed.
  void Write(alarm_t& message, std::int64_t utime);

 private:
  struct Entry {
    AlarmSpec spec;
    AlarmState state = AlarmState::kAbsent;
    bool unknown = false;
    std::int64_t first_utime = 0;
    std::int64_t last_utime = 0;
    std::int32_t count = 0;
  };
  [[nodiscard]] Entry* Find(const AlarmSpec& alarm);
  void Arrange(alarm_t& message);
  [[nodiscard]] static bool Worse(const Entry* a, const Entry* b);

  static constexpr std::size_t kExpected = 32;

  std::vector<Entry> entries_;       // every alarm ever seen
  std::vector<const Entry*> shown_;  // those of the last message; hold as long as the revision does
  std::int64_t shown_revision_ = 0;
  bool offline_ = false;
  std::int64_t revision_ = 0;
};

}  // namespace axlecast
