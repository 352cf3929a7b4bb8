#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/position_query.h"
#include "tools/fleet/read/table_writer.h"

namespace axlecast {

// How a column of the database is written.
enum class ColumnKind : std::uint8_t {
  kInt,
  kFloat,
  kText,
  kBool,
  kHex,    // an int8 as 16 hex digits: boot ids
  kUuid,   // 32 hex digits
  kList,   // an array of numbers, as JSON
  kUtime,  // a time, as us of UNIX time
};

struct EventColumn {
  const char* name;  // as in the answer
  const char* sql;   // expression
  ColumnKind kind;
};

// A table of the database whose rows are events of a machine.
struct EventTable {
  std::string_view kind;  // as in `axlecast fleet query`
  const char* table;      // with an alias `e`
  const char* time;       // expression of the time of a row
  const char* device;     // expression that --device is compared with; "": the rows belong to no device
  const char* message;    // expression of the whole message; "": none
  std::span<const EventColumn> columns;
};

// Returns all of them. positions, seconds and minutes are not among them: position_query.h.
[[nodiscard]] std::span<const EventTable> EventTables();

// Returns the columns of the answer: `utime`, `utc`, those of the table, and `message`.
[[nodiscard]] std::vector<std::string> EventColumns(const EventTable& table, bool message);

struct EventQuery {
  QueryTimes times;
  std::string device;    // empty: all
  bool message = false;  // with the whole message
  std::int64_t limit = 0;
};

// Writes the rows of the machine by time. Does not end the table.
[[nodiscard]] Result<QueryResult> WriteEvents(FleetReader& reader, const FleetMachine& machine,
                                              const EventTable& source, const EventQuery& query,
                                              TableWriter& table);

}  // namespace axlecast
