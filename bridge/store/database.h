#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace axlecast {

// The only file that uses SQLite.

// What a parameter of a statement is bound to; nothing is NULL.
using SqlValue = std::variant<std::nullptr_t, std::int64_t, double, std::string_view>;
[[nodiscard]] inline SqlValue OrNull(const std::optional<std::int64_t>& value) {
  return value ? SqlValue(*value) : SqlValue(nullptr);
}

class Database;

// The rows that a statement answers. Must go before its database, and before the same text is run again.
class Rows {
 public:
  Rows(Rows&& other) noexcept;
  Rows& operator=(Rows&&) = delete;
  ~Rows();

  // The next row, at first the first; false at their end, and when one cannot be read (Database::result).
  [[nodiscard]] bool Next();
  // Of the present row, columns from 0. A NULL is 0 or empty.
  [[nodiscard]] std::int64_t Integer(int column) const;
  [[nodiscard]] double Real(int column) const;
  [[nodiscard]] std::string Text(int column) const;
  [[nodiscard]] bool IsNull(int column) const;

 private:
  friend class Database;
  Rows(Database& database, sqlite3_stmt* statement) : database_(database), statement_(statement) {}

  Database& database_;
  sqlite3_stmt* statement_;  // null: it failed before the first row
};

// Makes the folders of a file to be written (0750), and the file (0640) if it is missing.
[[nodiscard]] Result<> PrepareFile(const std::string& path);

// One open database file. Statements are prepared once and kept.
class Database {
 public:
  enum class Access : std::uint8_t { kReadOnly, kReadWrite };

  // Opens a file. With kReadWrite, a missing file is made, for its owner and group only (folders 0750, the file 0640), and
  // a commit is on the disk when it returns. With kReadOnly, the content never changes.
  [[nodiscard]] static Result<std::unique_ptr<Database>> Open(const std::string& path, Access access);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // Executes a statement without result rows. Returns false on failure (see result()).
  [[nodiscard]] bool Execute(std::string_view sql, std::initializer_list<SqlValue> values = {});
  [[nodiscard]] Rows Select(std::string_view sql, std::span<const SqlValue> values);
  [[nodiscard]] Rows Select(std::string_view sql, std::initializer_list<SqlValue> values = {});

  // Executes `writes` in one transaction, and commits it if `writes` returns true. Returns true if it is on the disk.
  [[nodiscard]] bool Transact(const std::function<bool()>& writes);

  [[nodiscard]] std::int64_t changed_rows() const;     // by the last statement
  [[nodiscard]] std::int64_t inserted_number() const;  // INTEGER PRIMARY KEY of the last row inserted
  // The last failure since the begin of the last transaction: the file, the cause, and the fix.
  [[nodiscard]] const Result<>& result() const { return result_; }
  // Returns true if after the last failure the file must be replaced or reopened.
  [[nodiscard]] bool lost() const { return lost_; }

 private:
  friend class Rows;
  Database(std::string path, sqlite3* handle);
  [[nodiscard]] bool Begin(Access access);
  [[nodiscard]] sqlite3_stmt* Prepared(std::string_view sql, std::span<const SqlValue> values);
  void Fail(int code);

  const std::string path_;
  sqlite3* const handle_;
  std::map<std::string, sqlite3_stmt*, std::less<>> statements_;
  Result<> result_;
  bool lost_ = false;
};

// The version of the tables in the journal's file: docs/journal.md describes them.
inline constexpr std::int64_t kSchemaVersion = 1;

// Makes the tables in an empty file. Otherwise checks that the tables are ours, of a version that this program knows, and
// of `machine`.
[[nodiscard]] Result<> PrepareSchema(Database& database, const std::string& path, const std::string& machine);

// The same for a reader; empty `machine`: of any.
[[nodiscard]] Result<> CheckSchema(Database& database, const std::string& path, const std::string& machine);

// A file that no bridge has opened since these were added has none.
[[nodiscard]] bool HasAlarmMarks(Database& database);

// Whose it is, of a file that was checked.
[[nodiscard]] std::string MachineOf(Database& database);

}  // namespace axlecast
