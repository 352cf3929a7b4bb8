#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/device/can.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Calls a visitor with every selected event of a log, in order, until the visitor returns false. It can be called several
// times and shows the same events each time.
using EventVisitor = std::function<bool(const LogEvent&)>;
using EventRange = std::function<void(const EventVisitor&)>;

// Takes the next part of the output. Returns false if it cannot be written; then the conversion ends.
using Output = std::function<bool(std::string_view)>;

// The result of a conversion.
struct Conversion {
  std::int64_t written = 0;   // messages, frames or rows
  std::int64_t left_out = 0;  // malformed events, and events that the format cannot contain
  std::string note;           // a limitation that the reader of the output should know; empty: none
};

// Returns the time of the event's message, in us of UNIX time: its `utime` if it has one between 1970 and 9999, else the
// time of its reception. The message is not decoded and may be malformed.
[[nodiscard]] std::int64_t SampleTime(const LogEvent& event);

// Calls `visit` with the name and value of each plain value of a message's JSON: "value", "spare[1]", "entries[0].code". The names
// of flags are one value: "valid turns_valid".
using FieldVisitor = std::function<void(const std::string& name, const nlohmann::ordered_json& value)>;
void VisitFields(const nlohmann::ordered_json& message, const FieldVisitor& visit);

// Returns the value with this name, or null if the message does not contain it.
[[nodiscard]] const nlohmann::ordered_json* FindField(const nlohmann::ordered_json& message, std::string_view name);

// Returns true if every message of the type has the same names: its schema contains no list of variable length, and no
// message that may be missing.
[[nodiscard]] bool AlwaysSameFields(std::string_view schema);

// Appends one cell of a CSV record according to RFC 4180. Cells with commas, quotes or line ends are quoted.
// Bytes that are not UTF-8, and NUL, become U+FFFD. Spreadsheets interpret a cell that begins with = + - @, tab or CR as
// a formula: such a cell gets a leading apostrophe, unless it is a number.
void AppendCsvCell(std::string& line, std::string_view cell);

// Returns one CSV record of these cells, with CR LF at its end.
[[nodiscard]] std::string CsvLine(const std::vector<std::string>& cells);

// Writes one row for each message: `log_utime` (us, reception), `channel`, and the fields of all types that occur, under
// their JSON names ("accel_mps2[0]"). Fields that a message does not have, and null, are empty. Malformed messages and
// messages of other programs are left out.
[[nodiscard]] Conversion WriteCsvTable(const EventRange& events, const Output& out);

struct TimeGrid {
  std::int64_t period_us = 0;   // rows are at its multiples of UNIX time; above 0
  std::int64_t max_age_us = 0;  // of a reading; 0: the limit in the device's DEVICE message
};

// Writes the positions of all devices on one time grid: `utime`, then `value`, `counts` and `flags` of each POSITION
// channel. `value` and `counts` are interpolated between the readings before and after the row; `flags` are from the
// reading before. They are empty
// - without a valid reading,
// - between readings with a different datum,
// - between readings further apart than the maximum age.
// `value` needs the DEVICE messages, which are searched in `all`. Messages that are no positions are left out.
[[nodiscard]] Result<Conversion> WriteCsvGrid(const EventRange& events, const EventRange& all, const TimeGrid& grid,
                                              const Output& out);

// Writes the events as an MCAP file, with the name of the channel as topic:
// - Messages of axlecast are JSON with a JSON Schema ("axlecast.position_t").
// - Malformed messages and messages of other programs are copied, with message encoding "lcm" and without a schema.
// - log_time is the time of reception, publish_time the message's `utime`.
// - The log's own texts (tools/log/log_event.h) become attachments. Its seals refer to bytes of the log: left out.
[[nodiscard]] Conversion WriteMcap(const EventRange& events, const Output& out);

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
