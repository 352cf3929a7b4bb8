#pragma once

#include <string>
#include <string_view>

#include "drivers/runtime/simulation/shaft.h"

namespace axlecast {

// Orders a motion by its text: "stop", "sine:AMPLITUDE_DEG,PERIOD_S", "shuttle:FROM_DEG,TO_DEG,RPM" or
// "move:TO_DEG,RPM". Angles count through the turns (720 is two turns from 0), before any zero. Empty when it
// began, else what would be right.
[[nodiscard]] std::string OrderMotion(Shaft& shaft, std::string_view text, MonoNs now);

}  // namespace axlecast
