#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/device/can.h"
#include "tools/convert/conversion.h"

namespace axlecast {

// Returns a frame in the format of `candump -L`: "(1436509052.249713) can0 044#2A366C2BBA". The interface name is cut to
// 15 characters, as in Linux. Characters other than printable ASCII become '_'.
[[nodiscard]] std::string CandumpLine(std::int64_t ns, std::string_view interface, const CanFrame& frame);

// Writes one line for each frame of the CAN captures (WIRE/<bus>), under the name of the bus.
[[nodiscard]] Result<Conversion> WriteCandump(const EventRange& events, const Output& out);

// Writes wire captures (WIRE/<bus>) as a pcap file with times in ns (draft-ietf-opsawg-pcap). CAN captures have
// LINKTYPE_CAN_SOCKETCAN (227) and contain the frames that were on the bus. Captures of serial lines and SPI have
// LINKTYPE_USER0 (147) and contain every record. One file has one link type: captures of both are an error.
//
// A USER0 packet has this header before the data, big-endian:
//   0  version, 1
//   1  kind      wire_t KIND_*: 0 serial, 2 SPI
//   2  direction wire_record_t DIRECTION_*: 0 transmit, 1 receive, 2 stray, 3 silent, 4 link up, 5 link down, 6 pulse,
//                7 retuned
//   3  flags     wire_record_t FLAG_*: 1 redacted, 2 timeout, 4 character error
//   4  int32     index of the device in the machine file, -1 for the bus; on SPI the clock in Hz
//   8  int32     ns from the packet's time until the write, or the last read, returned
//  12  length of the bus name; the name; then the data
[[nodiscard]] Result<Conversion> WritePcap(const EventRange& events, const Output& out);

}  // namespace axlecast
