#pragma once

#include <axlecast/wire_t.hpp>
#include <cstdint>
#include <functional>
#include <optional>

#include "core/device/can.h"

namespace axlecast {

// One record of a WIRE message, with its instant: ns since 1970.
using WireVisitor = std::function<bool(std::int64_t ns, const wire_t& message, const wire_record_t& record)>;

// Shows the records of a message in order, as long as the visitor says true; false when it did not.
bool VisitRecords(const wire_t& message, const WireVisitor& visit);

// The frame that a CAN capture's record says was on the bus: received, or an own one that was confirmed. What was only
// queued, and what speaks of the line, is none.
[[nodiscard]] std::optional<CanFrame> FrameOnBus(const wire_record_t& record);

}  // namespace axlecast
