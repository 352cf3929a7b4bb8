#pragma once

#include <axlecast/argument_t.hpp>
#include <axlecast/change_t.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/journal.h"

namespace axlecast {

// A row of the table `commands`.

// In the order in which CommandOf reads them.
inline constexpr std::string_view kCommandColumns =
    "number, id, accepted_utime, begin_by_utime, device, operation, arguments, reason, who, key_id, is_unsigned, "
    "body_digest, bridge_boot_id, driver_boot_id, sent_epoch, state, verified, finding, reason_code, text, "
    "progress, "
    "token, started_utime, finished_utime, epoch_after, changes";

struct CommandRow {
  std::int64_t number = 0;
  CommandRecord record;
  std::int64_t sent_epoch = 0;
};

[[nodiscard]] CommandRow CommandOf(const Rows& row);

// As JSON: [{"key": ..., "value": ...}, ...] and [{"key": ..., "before": ..., "after": ...}, ...]. What is no UTF-8
// is mended; what is no such text is read as nothing.
[[nodiscard]] std::string ArgumentsText(const std::vector<argument_t>& arguments);
[[nodiscard]] std::string ChangesText(const std::vector<change_t>& changes);
[[nodiscard]] std::vector<change_t> ParseChanges(std::string_view text);

// The token as 32 hex digits; empty without one.
[[nodiscard]] std::string TokenText(const command_status_t& status);

}  // namespace axlecast
