#pragma once

#include <functional>

#include "core/base/time.h"
#include "core/device/probe.h"
#include "drivers/runtime/bus/stale_reply_guard.h"
#include "drivers/runtime/bus/transactor.h"

namespace axlecast {

// Carries the probe's steps out until the probe is through, the link is lost (false), or `stop` returns true, which is called
// before every step. `guard` outlives all probes of one line, and has one device. While the reply to an earlier request may
// still come, no request is sent whose reply looks like it: the probe waits.
[[nodiscard]] bool RunProbe(Probe& probe, Transactor& medium, const Clock& clock, StaleReplyGuard& guard,
                            const std::function<bool()>& stop);

}  // namespace axlecast
