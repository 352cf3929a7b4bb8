#include "bridge/store/database.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sqlite3.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "core/messages/enum_names.h"
#include "platform/os/descriptor.h"
#include "platform/os/folder.h"

namespace axlecast {
namespace {

constexpr int kBusyMs = 100;  // at most in the way of the bridge
constexpr std::int64_t kLogBytes = 16 << 20;

// What a person can do about a failure of `path`. `system`: errno, 0 unknown.
std::string Remedy(int code, int system, const std::string& path) {
  if (system == ENOSPC || system == EDQUOT || system == EFBIG) code = SQLITE_FULL;
  if (system == EROFS) code = SQLITE_READONLY;
  if (system == EACCES || system == EPERM) code = SQLITE_PERM;
  switch (code) {
    case SQLITE_FULL:
      return "no room for it: make room on its disk (df " + path + "), or lift the limit";
    case SQLITE_READONLY:
      return "it can only be read: mount its disk writable, or let this user write the file and its folder";
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return "permission denied: let user " + std::to_string(geteuid()) + " write the file and its folder";
    case SQLITE_CORRUPT:
      return "it is damaged: move it away, with -wal and -shm; then restore a backup (docs/journal.md)";
    case SQLITE_NOTADB:
      return "it is no SQLite database: move it away, or name another file";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "another program keeps it locked: end its transaction (fuser " + path + " names it)";
    case SQLITE_IOERR:
      // SQLite provides no errno for writes.
      return "its disk fails, can only be read, or a quota or limit is reached: look at df " + path +
             ", quota, and the kernel's log (dmesg)";
    default:
      return "";
  }
}

tl::unexpected<Error> Failed(const std::string& path, int code, int system, const std::string& what) {
  const std::string remedy = Remedy(code, system, path);
  const std::string cause = system != 0 ? std::string(std::strerror(system)) : what;
  return Failure(path + ": " + cause + (remedy.empty() ? "" : "; " + remedy));
}

// As Failed, for what fails before SQLite sees it.
tl::unexpected<Error> SystemFailed(const std::string& path) { return Failed(path, SQLITE_OK, errno, ""); }

Result<> MakeFoldersOf(const std::string& path) {
  std::string failed;
  errno = MakeFolders(std::filesystem::path(path).parent_path().string(), 0750, failed);
  return errno == 0 ? Result<>() : SystemFailed(failed);
}

// O_NONBLOCK: a FIFO under this name must not keep the bridge waiting.
Result<> CheckFile(const std::string& path, int flags) {
  const Descriptor file(open(path.c_str(), flags | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0640));
  if (!file.valid()) return SystemFailed(path);
  struct stat status {};
  if (fstat(file.get(), &status) != 0) return SystemFailed(path);
  if (!S_ISREG(status.st_mode)) return Failure(path + " is no regular file: name the journal's file");
  if ((status.st_mode & S_IWOTH) != 0) return Failure(path + " can be written by everybody: chmod 640 " + path);
  return {};
}

// Returns true for a copy of a journal: it has no -wal file, and this user cannot create the files that SQLite needs for a
// reader.
bool IsStill(const std::string& path) {
  return access((path + "-wal").c_str(), F_OK) != 0 &&
         faccessat(AT_FDCWD, std::filesystem::absolute(path).parent_path().c_str(), W_OK, AT_EACCESS) != 0;
}

// As SQLite's URI; https://sqlite.org/uri.html
std::string Uri(const std::string& path, const char* query) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '%' || c == '?' || c == '#') {
      const auto byte = static_cast<unsigned char>(c);
      uri += {'%', kDigits[byte >> 4U], kDigits[byte & 15U]};
    } else {
      uri += c;
    }
  }
  return uri + query;
}

struct Binder {
  sqlite3_stmt* statement;
  int index;

  int operator()(std::nullptr_t) const { return sqlite3_bind_null(statement, index); }
  int operator()(std::int64_t value) const { return sqlite3_bind_int64(statement, index, value); }
  int operator()(double value) const { return sqlite3_bind_double(statement, index, value); }
  int operator()(std::string_view value) const {
    // An empty view may hold a null pointer, which would be NULL.
    return sqlite3_bind_text64(statement, index, value.empty() ? "" : value.data(), value.size(), SQLITE_TRANSIENT,
                               SQLITE_UTF8);
  }
};

constexpr std::string_view kMeta =
    "CREATE TABLE meta (key TEXT PRIMARY KEY NOT NULL, value NOT NULL) WITHOUT ROWID";

constexpr std::array<std::string_view, 10> kTables = {
    // The numbers of state, finding and reason_code as words.
    R"(CREATE TABLE words (
  kind TEXT NOT NULL, number INTEGER NOT NULL, word TEXT NOT NULL, PRIMARY KEY (kind, number)) WITHOUT ROWID)",
    R"(CREATE TABLE commands (
  number INTEGER PRIMARY KEY,
  id TEXT NOT NULL UNIQUE,
  accepted_utime INTEGER NOT NULL,
  begin_by_utime INTEGER NOT NULL,
  device TEXT NOT NULL,
  operation TEXT NOT NULL,
  arguments TEXT NOT NULL,
  reason TEXT NOT NULL,
  who TEXT NOT NULL,
  key_id INTEGER NOT NULL,
  is_unsigned INTEGER NOT NULL,
  body_digest INTEGER NOT NULL,
  bridge_boot_id INTEGER NOT NULL,
  driver_boot_id INTEGER NOT NULL,
  sent_epoch INTEGER NOT NULL,
  state INTEGER NOT NULL,
  verified INTEGER NOT NULL,
  finding INTEGER NOT NULL,
  reason_code INTEGER NOT NULL,
  text TEXT NOT NULL,
  progress REAL NOT NULL,
  token TEXT NOT NULL,
  started_utime INTEGER NOT NULL,
  finished_utime INTEGER NOT NULL,
  epoch_after INTEGER NOT NULL,
  changes TEXT NOT NULL))",
    "CREATE INDEX commands_of_device ON commands (device, number)",
    "CREATE INDEX commands_open ON commands (number) WHERE state < 4 OR (state = 9 AND finding = 0)",
    R"(CREATE TABLE steps (
  number INTEGER PRIMARY KEY,
  command INTEGER NOT NULL REFERENCES commands (number),
  utime INTEGER NOT NULL,
  state INTEGER NOT NULL,
  verified INTEGER NOT NULL,
  finding INTEGER NOT NULL,
  reason_code INTEGER NOT NULL,
  text TEXT NOT NULL,
  progress REAL NOT NULL,
  changes TEXT NOT NULL))",
    "CREATE INDEX steps_of_command ON steps (command, number)",
    R"(CREATE TABLE datums (
  number INTEGER PRIMARY KEY,
  device TEXT NOT NULL,
  utime INTEGER NOT NULL,
  counts INTEGER NOT NULL,
  value TEXT NOT NULL,
  identity TEXT NOT NULL,
  who TEXT NOT NULL,
  command TEXT NOT NULL,
  reason TEXT NOT NULL,
  voided_utime INTEGER,
  voided_why TEXT))",
    "CREATE INDEX datums_of_device ON datums (device, number)",
    R"(CREATE TABLE axes (
  device TEXT PRIMARY KEY NOT NULL,
  identity TEXT NOT NULL DEFAULT '',
  reference_lost INTEGER NOT NULL DEFAULT 0,
  writes INTEGER NOT NULL DEFAULT 0,
  since_utime INTEGER NOT NULL DEFAULT 0,
  position_counts INTEGER,
  position_utime INTEGER,
  datum INTEGER REFERENCES datums (number)) WITHOUT ROWID)",
    R"(CREATE TABLE events (
  number INTEGER PRIMARY KEY,
  utime INTEGER NOT NULL,
  device TEXT NOT NULL,
  kind TEXT NOT NULL,
  text TEXT NOT NULL))",
};

// Came later than the others: made where it is missing. Who does not know it passes over it, so the version stays.
constexpr std::string_view kAlarmMarks = R"(CREATE TABLE IF NOT EXISTS alarm_marks (
  device TEXT NOT NULL,
  kind TEXT NOT NULL,
  alarm TEXT NOT NULL,
  utime INTEGER NOT NULL,
  until_utime INTEGER NOT NULL,
  up_to TEXT NOT NULL,
  who TEXT NOT NULL,
  reason TEXT NOT NULL,
  command TEXT NOT NULL,
  driver_boot_id INTEGER NOT NULL,
  known_utime INTEGER NOT NULL,
  PRIMARY KEY (device, kind, alarm)) WITHOUT ROWID)";

// A view for people: `commands` with words instead of codes.
constexpr std::string_view kView = R"(CREATE VIEW history AS
  SELECT c.number, strftime('%Y-%m-%d %H:%M:%S', c.accepted_utime / 1000000, 'unixepoch') AS time, c.id, c.who,
         c.device, c.operation, c.arguments, s.word AS outcome, r.word AS cause, f.word AS found, c.verified, c.text,
         c.changes, c.reason
  FROM commands c
  LEFT JOIN words s ON s.kind = 'state' AND s.number = c.state
  LEFT JOIN words r ON r.kind = 'reason' AND r.number = c.reason_code
  LEFT JOIN words f ON f.kind = 'finding' AND f.number = c.finding)";

constexpr std::string_view kVersionKey = "schema_version";
constexpr std::string_view kMachineKey = "machine";

// Of every number that this program knows; a newer program adds its own.
bool WriteWords(Database& database) {
  const auto write = [&database](std::string_view kind, auto name) {
    for (int number = 0; number == 0 || name(number) != "unknown"; ++number) {
      if (!database.Execute("INSERT OR REPLACE INTO words (kind, number, word) VALUES (?, ?, ?)",
                            {kind, std::int64_t{number}, name(number)})) {
        return false;
      }
    }
    return true;
  };
  return write("state", [](int number) { return StateName(static_cast<std::int8_t>(number)); }) &&
         write("finding", [](int number) { return FindingName(static_cast<std::int8_t>(number)); }) &&
         write("reason", [](int number) { return ReasonName(number); });
}

bool Make(Database& database, const std::string& machine) {
  return database.Transact([&] {
    if (!database.Execute(kMeta)) return false;
    for (const std::string_view table : kTables) {
      if (!database.Execute(table)) return false;
    }
    constexpr std::string_view kInsert = "INSERT INTO meta (key, value) VALUES (?, ?)";
    return database.Execute(kAlarmMarks) && database.Execute(kView) && WriteWords(database) &&
           database.Execute(kInsert, {kVersionKey, kSchemaVersion}) &&
           database.Execute(kInsert, {kMachineKey, machine});
  });
}

// How many tables there are; nothing when that cannot be read.
std::optional<std::int64_t> CountTables(Database& database, std::string_view name) {
  Rows rows = database.Select("SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name LIKE ?", {name});
  return rows.Next() ? std::optional(rows.Integer(0)) : std::nullopt;
}

std::string MetaText(Database& database, std::string_view key) {
  Rows rows = database.Select("SELECT value FROM meta WHERE key = ?", {key});
  return rows.Next() ? rows.Text(0) : "";
}

Error NoJournal(const std::string& path) {
  return {path + " is no journal of axlecast: name another file (bridge: journal)"};
}

Result<> CheckVersion(Database& database, const std::string& path) {
  const std::string text = MetaText(database, kVersionKey);
  if (text == std::to_string(kSchemaVersion)) return {};
  if (!database.result()) return database.result();
  if (text.empty()) return Failure(NoJournal(path));
  return Failure(path + " was written by a newer axlecast (its version is " + text + ", this program knows " +
                 std::to_string(kSchemaVersion) +
                 "): install the newer one, or name another file (bridge: journal)");
}

}  // namespace

Result<> PrepareFile(const std::string& path) {
  if (Result<> links = CheckLinks(path); !links) return links;
  if (Result<> made = MakeFoldersOf(path); !made) return made;
  return CheckFile(path, O_RDWR | O_CREAT);
}

Rows::Rows(Rows&& other) noexcept
    : database_(other.database_), statement_(std::exchange(other.statement_, nullptr)) {}

Rows::~Rows() {
  if (statement_ != nullptr) sqlite3_reset(statement_);
}

bool Rows::Next() {
  if (statement_ == nullptr) return false;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code != SQLITE_DONE) database_.Fail(code);
  sqlite3_reset(std::exchange(statement_, nullptr));
  return false;
}

std::int64_t Rows::Integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Rows::Real(int column) const { return sqlite3_column_double(statement_, column); }
bool Rows::IsNull(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

std::string Rows::Text(int column) const {
  const void* text = sqlite3_column_text(statement_, column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
  return text == nullptr ? "" : std::string(static_cast<const char*>(text), size);
}

Database::Database(std::string path, sqlite3* handle) : path_(std::move(path)), handle_(handle) {}

Database::~Database() {
  for (const auto& [text, statement] : statements_) sqlite3_finalize(statement);
  sqlite3_close(handle_);
}

Result<std::unique_ptr<Database>> Database::Open(const std::string& path, Access access) {
  const bool writes = access == Access::kReadWrite;
  if (Result<> usable = writes ? PrepareFile(path) : CheckFile(path, O_RDONLY); !usable)
    return Failure(usable.error());
  sqlite3* handle = nullptr;
  const int flags = (writes ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_URI;
  const std::string uri = Uri(path, !writes && IsStill(path) ? "?immutable=1" : "");
  const int code = sqlite3_open_v2(uri.c_str(), &handle, flags, nullptr);
  std::unique_ptr<Database> database(new Database(path, handle));
  if (code == SQLITE_OK && database->Begin(access)) return database;
  if (code != SQLITE_OK) database->Fail(code);
  return Failure(database->result().error());
}

bool Database::Begin(Access access) {
  sqlite3_extended_result_codes(handle_, 1);
  sqlite3_busy_timeout(handle_, kBusyMs);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  const auto set = [this](const char* pragma) {
    result_ = {};
    Rows rows = Select(pragma);
    while (rows.Next()) continue;
    return result_.has_value();
  };
  if (access == Access::kReadOnly) return set("PRAGMA query_only = 1") && set("SELECT count(*) FROM sqlite_schema");
  // So that -wal and -shm stay: a reader may not be allowed to make them.
  int keep = 1;
  sqlite3_file_control(handle_, "main", SQLITE_FCNTL_PERSIST_WAL, &keep);
  return set("PRAGMA journal_mode = WAL") && set("PRAGMA synchronous = FULL") && set("PRAGMA foreign_keys = 1") &&
         set(("PRAGMA journal_size_limit = " + std::to_string(kLogBytes)).c_str());
}

sqlite3_stmt* Database::Prepared(std::string_view sql, std::span<const SqlValue> values) {
  auto kept = statements_.find(sql);
  if (kept == statements_.end()) {
    sqlite3_stmt* made = nullptr;
    const int code = sqlite3_prepare_v3(handle_, sql.data(), static_cast<int>(sql.size()),
                                        SQLITE_PREPARE_PERSISTENT, &made, nullptr);
    if (code != SQLITE_OK) {
      Fail(code);
      return nullptr;
    }
    kept = statements_.emplace(sql, made).first;
  }
  int index = 1;
  for (const SqlValue& value : values) {
    if (const int code = std::visit(Binder{kept->second, index++}, value); code != SQLITE_OK) {
      Fail(code);
      return nullptr;
    }
  }
  return kept->second;
}

bool Database::Execute(std::string_view sql, std::initializer_list<SqlValue> values) {
  sqlite3_stmt* const statement = Prepared(sql, std::span(values.begin(), values.size()));
  if (statement == nullptr) return false;
  const int code = sqlite3_step(statement);
  if (code != SQLITE_DONE && code != SQLITE_ROW) Fail(code);
  sqlite3_reset(statement);
  return code == SQLITE_DONE || code == SQLITE_ROW;
}

Rows Database::Select(std::string_view sql, std::span<const SqlValue> values) {
  return {*this, Prepared(sql, values)};
}

Rows Database::Select(std::string_view sql, std::initializer_list<SqlValue> values) {
  return Select(sql, std::span(values.begin(), values.size()));
}

bool Database::Transact(const std::function<bool()>& writes) {
  result_ = {};
  lost_ = false;
  if (!Execute("BEGIN IMMEDIATE")) return false;
  if (writes() && Execute("COMMIT")) return true;
  if (sqlite3_get_autocommit(handle_) != 0) return false;  // rolled back already
  const Result<> result = result_;
  if (Execute("ROLLBACK")) result_ = result;
  return false;
}

std::int64_t Database::changed_rows() const { return sqlite3_changes64(handle_); }
std::int64_t Database::inserted_number() const { return sqlite3_last_insert_rowid(handle_); }

void Database::Fail(int code) {
  const int primary = code & 0xFF;
  const bool system = primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN || primary == SQLITE_PERM;
  const std::string what = handle_ == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(handle_);
  result_ = Failed(path_, primary, system && handle_ != nullptr ? sqlite3_system_errno(handle_) : 0, what);
  lost_ = primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB || code == SQLITE_READONLY_DBMOVED;
}

Result<> PrepareSchema(Database& database, const std::string& path, const std::string& machine) {
  const std::optional<std::int64_t> tables = CountTables(database, "%");
  if (!tables) return database.result();
  if (*tables == 0) return Make(database, machine) ? Result<>() : database.result();
  if (Result<> checked = CheckSchema(database, path, machine); !checked) return checked;
  const bool completed =
      database.Transact([&database] { return database.Execute(kAlarmMarks) && WriteWords(database); });
  return completed ? Result<>() : database.result();
}

Result<> CheckSchema(Database& database, const std::string& path, const std::string& machine) {
  const std::optional<std::int64_t> tables = CountTables(database, "meta");
  if (!tables) return database.result();
  if (*tables == 0) return Failure(NoJournal(path));
  if (Result<> checked = CheckVersion(database, path); !checked) return checked;
  const std::string owner = MachineOf(database);
  if (machine.empty() || owner == machine) return {};
  return Failure(path + " is the journal of machine '" + owner + "', not of '" + machine +
                 "': name another file (bridge: journal)");
}

bool HasAlarmMarks(Database& database) { return CountTables(database, "alarm_marks").value_or(0) > 0; }

std::string MachineOf(Database& database) { return MetaText(database, kMachineKey); }

}  // namespace axlecast
