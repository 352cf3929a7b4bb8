#pragma once

#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "core/messages/message.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {

using Long = long long;  // as printf requires it

// What became of the positions of one mode.
struct Tally {
  // Counts a message on POSITION/axis1 as valid or withheld; the position when it is valid.
  [[nodiscard]] std::optional<position_t> Count(const std::string& channel, Bytes message);

  std::int64_t withheld = 0, valid = 0;
  std::int64_t wrong = 0;    // valid, and not where the shaft was
  std::int64_t outside = 0;  // of these, where the shaft could not be
};

// Whether a count is what theory expects: within five standard deviations, 5 % for what it leaves out, and 3.
[[nodiscard]] bool Agrees(std::int64_t seen, double expected);

// A line each. `expected`: wrong ones that theory expects to be published.
void PrintWrong(const Tally& tally, double expected);
void PrintErrors(const DevicePublisher& channel);

}  // namespace axlecast
