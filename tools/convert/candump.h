#pragma once

#include <string>
#include <string_view>

#include "core/device/can.h"
#include "tools/convert/conversion.h"
#include "tools/convert/event_range.h"

namespace axlecast {

// A frame as `candump -L` writes it: "(1436509052.249713) can0 044#2A366C2BBA". The interface's name is cut at 15
// characters, as Linux has them, and what is no printable ASCII becomes '_'.
[[nodiscard]] std::string CandumpLine(std::int64_t ns, std::string_view interface, const CanFrame& frame);

// The frames of the CAN captures (WIRE/<bus>) among the events, one line each, under the bus's name.
[[nodiscard]] Conversion WriteCandump(const EventRange& events, const Output& out);

}  // namespace axlecast
