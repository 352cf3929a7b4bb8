#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/change_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"

namespace axlecast {

// A row of the table `commands`.

// In the order in which CommandOf reads them.
inline constexpr std::string_view kCommandColumns =
    "number, id, accepted_utime, begin_by_utime, device, operation, arguments, reason, who, key_id, is_unsigned, "
    "body_digest, bridge_boot_id, driver_boot_id, sent_epoch, state, verified, finding, reason_code, text, "
    "progress, token, started_utime, finished_utime, epoch_after, changes";

struct CommandRow {
  std::int64_t number = 0;
  CommandRecord record;
  std::int64_t sent_epoch = 0;
};

[[nodiscard]] CommandRow CommandOf(const Rows& row);

// As JSON: [{"key": ..., "value": ...}, ...] and [{"key": ..., "before": ..., "after": ...}, ...]. Bytes that are
// not UTF-8 are replaced. Other text is read as an empty list.
[[nodiscard]] std::string ArgumentsText(const std::vector<argument_t>& arguments);
[[nodiscard]] std::string ChangesText(const std::vector<change_t>& changes);
[[nodiscard]] std::vector<change_t> ParseChanges(std::string_view text);

// The token as 32 hex digits; empty without one.
[[nodiscard]] std::string TokenText(const command_status_t& status);

// Rows of the tables `datums` and `axes`.

// In the order in which DatumOf reads them.
inline constexpr std::string_view kDatumColumns =
    "number, counts, utime, identity, value, who, command, reason, voided_utime, voided_why";
// In the order in which AxisOf reads them, before those of the datum that is in force (of which the number may be
// NULL).
inline constexpr std::string_view kAxisColumns =
    "a.identity, a.reference_lost, a.writes, a.since_utime, a.position_counts, a.position_utime, d.number, "
    "d.counts, d.utime, d.identity, d.value, d.who, d.command, d.reason, d.voided_utime, d.voided_why";
inline constexpr std::string_view kAxisTables = "axes a LEFT JOIN datums d ON d.number = a.datum";

[[nodiscard]] DatumRecord DatumOf(const Rows& row, int first_column);
[[nodiscard]] AxisRecord AxisOf(const Rows& row, int first_column);

}  // namespace axlecast
