#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "platform/db/database.h"
#include "tools/web/fleet_request.h"

namespace axlecast {

// How a column of an answer looks in JSON.
enum class FleetCell : std::uint8_t {
  kText,
  kInteger,
  kNumber,  // null unless finite
  kBool,
  kTime,  // us, UNIX time
  kJson,
};

struct FleetColumn {
  std::string_view name;
  FleetCell cell = FleetCell::kText;
};

// A list in an answer: one statement, of which each row becomes an object.
struct FleetTable {
  std::string_view type;                 // of the answer
  std::string_view list;                 // its field
  std::string_view sql;                  // parameters: $1 machine, $2 from, $3 to, as far as the request has them
  std::int64_t max_rows = 0;             // the statement returns one more if there are more
  std::span<const FleetColumn> columns;  // of the statement, in its order
};

// Returns the table that answers a request; kTrips and kCurve have frames of their own.
[[nodiscard]] const FleetTable& TableOf(FleetRequest::Kind kind);

// Returns the parameters of its statement.
[[nodiscard]] db::Parameters TableParameters(const FleetRequest& request);

// Returns a row of an answer as an object.
[[nodiscard]] nlohmann::ordered_json RowJson(std::span<const FleetColumn> columns, const db::Rows& rows, int row);

// Returns the frame. `utime`: of this host.
[[nodiscard]] std::string TableFrame(const FleetRequest& request, const FleetTable& table, const db::Rows& rows,
                                     std::int64_t utime);

// Returns `fleet_error`. `away`: the database does not answer at present.
[[nodiscard]] std::string FleetErrorFrame(const FleetRequest& request, std::string_view text, bool away);

}  // namespace axlecast
