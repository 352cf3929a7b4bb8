#pragma once

#include <string>

#include "bridge/store/database.h"

namespace axlecast {

// What stands in the journal's file. docs/journal.md tells it to whoever queries it.
inline constexpr std::int64_t kSchemaVersion = 1;

// Makes the tables in an empty file, or checks that these are ours, of a version that this program knows, and of
// `machine`. Empty, or why it cannot be used and what would help.
[[nodiscard]] std::string PrepareSchema(Database& database, const std::string& path, const std::string& machine);

// The same for a reader; empty `machine`: of any.
[[nodiscard]] std::string CheckSchema(Database& database, const std::string& path, const std::string& machine);

// A file that no bridge has opened since these were added has none.
[[nodiscard]] bool HasAlarmMarks(Database& database);

// Whose it is, of a file that was checked.
[[nodiscard]] std::string MachineOf(Database& database);

}  // namespace axlecast
