#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// A question of the page to the fleet database (docs/web_protocol.md).
struct FleetRequest {
  enum class Kind : std::uint8_t { kMachines, kDevices, kAlarms, kCommands, kTrips, kCurve };

  Kind kind = Kind::kMachines;
  std::int64_t id = 0;       // chosen by the page and repeated in the answer; 0 to kMaxFleetId
  std::string machine = {};  // empty for kMachines
  std::string device = {};   // of kCurve only, as `column`
  std::string column = {};   // FindCurveColumn
  std::int64_t from = 0;     // us, UNIX time: from <= t < to; of kAlarms, kCommands, kTrips and kCurve
  std::int64_t to = 0;

  bool operator==(const FleetRequest&) const = default;
};

inline constexpr std::int64_t kMaxFleetId = (std::int64_t{1} << 53) - 1;        // exact as a double
inline constexpr std::size_t kMaxFleetName = 128;                               // bytes
inline constexpr std::int64_t kMaxFleetSpan = 20LL * 366 * 86'400 * 1'000'000;  // us
inline constexpr std::int64_t kLatestFleetUtime = 4'102'444'800'000'000;        // 2100-01-01

// A quantity of a device of which the database has the past.
struct CurveColumn {
  std::string_view name;
  std::string_view unit;  // of a motor's column; a position has the unit of its stream
  bool motor = false;
};
// Returns null for a name that is unknown.
[[nodiscard]] const CurveColumn* FindCurveColumn(std::string_view name);

// Returns true if frames of this type are questions to the fleet database.
[[nodiscard]] bool IsFleetType(std::string_view type);

// Reads a question. `json`: the page's frame, an object whose `type` is a text.
[[nodiscard]] Result<FleetRequest> ParseFleetRequest(const nlohmann::ordered_json& json);

}  // namespace axlecast
