#pragma once

#include <string_view>

#include "bridge/store/axis_store.h"
#include "bridge/store/database.h"

namespace axlecast {

// Rows of the tables `datums` and `axes`.

// In the order in which DatumOf reads them.
inline constexpr std::string_view kDatumColumns =
    "number, counts, utime, identity, value, who, command, reason, voided_utime, voided_why";
// In the order in which AxisOf reads them, before those of the datum that is in force (of which the number may be
// NULL).
inline constexpr std::string_view kAxisColumns =
    "a.identity, a.reference_lost, a.writes, a.since_utime, a.position_counts, a.position_utime, d.number, "
    "d.counts, "
    "d.utime, d.identity, d.value, d.who, d.command, d.reason, d.voided_utime, d.voided_why";
inline constexpr std::string_view kAxisTables = "axes a LEFT JOIN datums d ON d.number = a.datum";

[[nodiscard]] DatumRecord DatumOf(const Rows& row, int first_column);
[[nodiscard]] AxisRecord AxisOf(const Rows& row, int first_column);

}  // namespace axlecast
