#pragma once

#include "core/device/can.h"

namespace axlecast {

// Adds to `controller` what one error frame of Linux (linux/can/error.h) reports: bus-offs, restarts, errors of the
// protocol, missing acknowledges, frames without room, and the error counters where the frame holds them. Touches nothing for a
// frame without kCanError. What a frame holds depends on the controller's driver: bit errors and missing acknowledges
// come only from those that report them, some after `ip link set can0 type can berr-reporting on`.
void CountCanError(const CanFrame& frame, CanController& controller);

}  // namespace axlecast
