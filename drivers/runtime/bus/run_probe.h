#pragma once

#include <functional>

#include "drivers/runtime/bus/medium.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/probe.h"

namespace axlecast {

// Carries the probe's steps out until it is through, the link is lost (false), or `stop` says so, which is asked before
// every step.
[[nodiscard]] bool RunProbe(Probe& probe, Medium& medium, const Clock& clock, const std::function<bool()>& stop);

}  // namespace axlecast
