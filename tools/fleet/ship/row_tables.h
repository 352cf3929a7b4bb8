#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "platform/db/copy_rows.h"
#include "platform/db/database.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// The rows of a batch as the tables of the database have them (tools/fleet/schema). Pure.

// What the database has for names.
struct RowIds {
  std::int32_t machine = 0;
  std::int32_t log = 0;
  std::vector<std::int32_t> streams;  // by their index in BatchRows
};

// Rows that are appended by COPY.
struct TableRows {
  std::string table;  // "axlecast.odd(machine, log, …)"
  db::CopyRows rows;
};
[[nodiscard]] std::vector<TableRows> CopyTables(const BatchRows& batch, const RowIds& ids);

// One statement that adds rows. Rows that the database has already (after the log before was deleted, RowComposer) are ignored;
// seconds and minutes are joined with those that it has.
struct RowStatement {
  std::string sql;
  db::Parameters parameters;
};
[[nodiscard]] std::vector<RowStatement> InsertStatements(const BatchRows& batch, const RowIds& ids);

// The days of UTC whose partitions the batch needs, as days since 1970-01-01.
[[nodiscard]] std::set<std::int64_t> DaysOf(const BatchRows& batch);

// The number of rows in tables other than those of positions.
[[nodiscard]] std::int64_t EventRows(const BatchRows& batch);

}  // namespace axlecast
