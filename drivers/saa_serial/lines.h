#pragma once

#include <optional>

#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {

// Reads the bus's key `lines`: {clk: {chip, line, low_us}, clr: {chip, line, low_us}} as far as its mode has them,
// and refuses modem-control lines. Errors go into the map's list.
void ParseLines(ConfigMap& map, const BusConfig& bus, SaaBus& into);

}  // namespace axlecast::saa_serial
