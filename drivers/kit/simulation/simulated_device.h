#pragma once

#include <string>
#include <string_view>

#include "core/base/time.h"

namespace axlecast {

// One device of a simulator, as a file, a script or a person sets it.
class SimulatedDevice {
 public:
  virtual ~SimulatedDevice() = default;

  // Time goes on to `now`; what is set from here on happens then.
  virtual void Advance(MonoNs now) = 0;
  // Sets one quantity. Empty when done, else what would be right.
  [[nodiscard]] virtual std::string Set(std::string_view name, std::string_view value) = 0;
};

}  // namespace axlecast
