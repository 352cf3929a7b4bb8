#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "platform/db/database.h"

namespace axlecast {

// One file of this folder. The number at the beginning of its name is the version of the schema after it.
struct MigrationText {
  std::string_view file;  // "001_tables.sql"
  std::string_view sql;
};

// Returns all files in the order of their numbers, which begin with 1 and have no gaps.
[[nodiscard]] const std::vector<MigrationText>& MigrationTexts();

// Returns the version of the schema that this program reads and writes.
[[nodiscard]] int SchemaVersion();

struct Migration {
  int from = 0;  // version that was found; 0: no schema
  int to = 0;
};

// Logins that become members of axlecast_writer and axlecast_reader; created without a password if they are missing. Empty: none.
struct FleetLogins {
  std::string writer;
  std::string reader;
};

// Creates the schema, or brings it to the version of this program, and creates the logins: all in one transaction, so that a failure
// changes nothing. Two callers at once do it one after the other. Fails if the server is older than PostgreSQL 15, or the schema newer
// than this program.
[[nodiscard]] db::DatabaseResult<Migration> MigrateSchema(db::Database& database, const FleetLogins& logins);

// Fails if the database does not have exactly the version of this program; the error states what to do.
[[nodiscard]] db::DatabaseResult<> CheckSchema(db::Database& database);

}  // namespace axlecast
