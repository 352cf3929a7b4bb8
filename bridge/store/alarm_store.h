#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/device/operation.h"

namespace axlecast {

// What an operator has said of an alarm, for as long as it holds.
struct AlarmMark {
  enum class Kind : std::uint8_t { kAcknowledged, kShelved };

  Kind kind = Kind::kAcknowledged;
  std::string alarm;             // its name
  std::int64_t utime = 0;        // us, UNIX time
  std::int64_t until_utime = 0;  // kShelved
  std::string up_to = {};        // kShelved: the severity that it hides at most
  std::string who = {};          // name of the key; "unsigned"
  std::string reason = {};
  CommandId command{};
  std::int64_t driver_boot_id = 0;  // that knows of it
  std::int64_t known_utime = 0;     // since when, us of that driver's UNIX time
};

// Durable memory of them: one of a kind for each alarm of a device. False where it could not be made durable.
class AlarmStore {
 public:
  virtual ~AlarmStore() = default;

  // In the place of the one that there is.
  [[nodiscard]] virtual bool SetMark(const std::string& device, const AlarmMark& mark) = 0;
  [[nodiscard]] virtual bool EndMark(const std::string& device, AlarmMark::Kind kind, const std::string& alarm) = 0;
  // In the order of their alarms.
  [[nodiscard]] virtual std::vector<AlarmMark> Marks(const std::string& device) const = 0;
};

}  // namespace axlecast
