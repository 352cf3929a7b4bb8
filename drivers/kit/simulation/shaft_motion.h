#pragma once

#include <string>
#include <string_view>

#include "drivers/kit/simulation/shaft.h"

namespace axlecast {

// The quantities of a simulated shaft by their text. Empty when done, else what would be right; `motion` becomes the text
// of what goes on.

// "stop", "sine:AMPLITUDE_DEG,PERIOD_S", "shuttle:FROM_DEG,TO_DEG,RPM" or "move:TO_DEG,RPM". Angles count through the
// turns (720 is two turns from 0), before any zero.
[[nodiscard]] std::string OrderMotion(Shaft& shaft, std::string_view text, MonoNs now, std::string& motion);
// rpm, counter-clockwise positive; the motion is "constant" then.
[[nodiscard]] std::string OrderSpeed(Shaft& shaft, std::string_view text, MonoNs now, std::string& motion);
// rad/s^2, of every ramp from now on.
[[nodiscard]] std::string OrderAcceleration(Shaft& shaft, std::string_view text);

}  // namespace axlecast
