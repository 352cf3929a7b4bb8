#pragma once

#include "tools/convert/conversion.h"
#include "tools/convert/event_range.h"

namespace axlecast {

// Wire captures (WIRE/<bus>) as a pcap file with times in ns (draft-ietf-opsawg-pcap): either CAN, as
// LINKTYPE_CAN_SOCKETCAN (227), of the frames that were on the bus; or serial lines and SPI, as LINKTYPE_USER0 (147), of
// everything that the driver did and heard. One file holds one of the two: captures of both are a problem that says so.
//
// Before the data of a USER0 packet stands a header of ours, big-endian:
//   0  version, 1
//   1  kind      wire_t KIND_*: 0 serial, 2 SPI
//   2  direction wire_record_t DIRECTION_*: 0 transmit, 1 receive, 2 stray, 3 silent, 4 link up, 5 link down, 6 pulse,
//                7 retuned
//   3  flags     wire_record_t FLAG_*: 1 redacted, 2 timeout, 4 character error
//   4  int32     the device by its order in the machine's file, -1 of the bus; on SPI the clock in Hz
//   8  int32     ns from the packet's time until the write, or the last read, returned
//  12  length of the bus's name; the name; then the data
[[nodiscard]] Conversion WritePcap(const EventRange& events, const Output& out);

}  // namespace axlecast
