#pragma once

#include <string_view>

namespace axlecast {

// How the answer of Link::Open ends while another process has the line: a serial or Modbus port, an SPI device, a CAN interface,
// an output line. A driver whose line stays held ends with it (driver.h), and adds the name of the process.
inline constexpr std::string_view kLineHeld =
    "another process holds it: end that one (is a second driver running?), or correct the port of this bus";

}  // namespace axlecast
