#include "bridge/store/database.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

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
      // SQLite tells no errno of writing.
      return "its disk fails, can only be read, or a quota or limit is reached: look at df " + path +
             ", quota, and the kernel's log (dmesg)";
    default:
      return "";
  }
}

std::string Problem(const std::string& path, int code, int system, const std::string& what) {
  const std::string remedy = Remedy(code, system, path);
  const std::string cause = system != 0 ? std::string(std::strerror(system)) : what;
  return path + ": " + cause + (remedy.empty() ? "" : "; " + remedy);
}

// As Problem, for what fails before SQLite sees it.
std::string SystemProblem(const std::string& path) { return Problem(path, SQLITE_OK, errno, ""); }

std::string MakeFolders(const std::string& path) {
  std::filesystem::path walked;
  for (const auto& part : std::filesystem::path(path).parent_path()) {
    walked /= part;
    if (mkdir(walked.c_str(), 0750) == 0 || errno == EEXIST) continue;
    struct stat status {};
    const int error = errno;  // of a folder that is there, too, where the disk is read-only
    if (stat(walked.c_str(), &status) == 0 && S_ISDIR(status.st_mode)) continue;
    errno = error;
    return SystemProblem(walked);
  }
  return "";
}

// O_NONBLOCK: a FIFO under this name must not keep the bridge waiting.
std::string CheckFile(const std::string& path, int flags) {
  const Descriptor file(open(path.c_str(), flags | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0640));
  if (!file.valid()) return SystemProblem(path);
  struct stat status {};
  if (fstat(file.get(), &status) != 0) return SystemProblem(path);
  if (!S_ISREG(status.st_mode)) return path + " is no regular file: name the journal's file";
  if ((status.st_mode & S_IWOTH) != 0) return path + " can be written by everybody: chmod 640 " + path;
  return "";
}

// A copy that nobody writes, as the bridge leaves -wal beside it, and where this user cannot make what SQLite wants
// there for a reader.
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

}  // namespace

std::string PrepareFile(const std::string& path) {
  std::string problem = ForeignLinkProblem(path);
  if (problem.empty()) problem = MakeFolders(path);
  return problem.empty() ? CheckFile(path, O_RDWR | O_CREAT) : problem;
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

std::unique_ptr<Database> Database::Open(const std::string& path, Access access, std::string& problem) {
  const bool writes = access == Access::kReadWrite;
  problem = writes ? PrepareFile(path) : CheckFile(path, O_RDONLY);
  if (!problem.empty()) return nullptr;
  sqlite3* handle = nullptr;
  const int flags = (writes ? SQLITE_OPEN_READWRITE : SQLITE_OPEN_READONLY) | SQLITE_OPEN_URI;
  const std::string uri = Uri(path, !writes && IsStill(path) ? "?immutable=1" : "");
  const int code = sqlite3_open_v2(uri.c_str(), &handle, flags, nullptr);
  std::unique_ptr<Database> database(new Database(path, handle));
  if (code == SQLITE_OK && database->Begin(access)) return database;
  if (code != SQLITE_OK) database->Fail(code);
  problem = database->problem();
  return nullptr;
}

bool Database::Begin(Access access) {
  sqlite3_extended_result_codes(handle_, 1);
  sqlite3_busy_timeout(handle_, kBusyMs);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  const auto set = [this](const char* pragma) {
    problem_.clear();
    Rows rows = Select(pragma);
    while (rows.Next()) continue;
    return problem_.empty();
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

bool Database::Execute(std::string_view sql, std::span<const SqlValue> values) {
  sqlite3_stmt* const statement = Prepared(sql, values);
  if (statement == nullptr) return false;
  const int code = sqlite3_step(statement);
  if (code != SQLITE_DONE && code != SQLITE_ROW) Fail(code);
  sqlite3_reset(statement);
  return code == SQLITE_DONE || code == SQLITE_ROW;
}

bool Database::Execute(std::string_view sql, std::initializer_list<SqlValue> values) {
  return Execute(sql, std::span(values.begin(), values.size()));
}

Rows Database::Select(std::string_view sql, std::span<const SqlValue> values) {
  return {*this, Prepared(sql, values)};
}

Rows Database::Select(std::string_view sql, std::initializer_list<SqlValue> values) {
  return Select(sql, std::span(values.begin(), values.size()));
}

bool Database::Transact(const std::function<bool()>& writes) {
  problem_.clear();
  lost_ = false;
  if (!Execute("BEGIN IMMEDIATE")) return false;
  if (writes() && Execute("COMMIT")) return true;
  if (sqlite3_get_autocommit(handle_) != 0) return false;  // rolled back already
  const std::string problem = problem_;
  if (Execute("ROLLBACK")) problem_ = problem;
  return false;
}

std::int64_t Database::changed_rows() const { return sqlite3_changes64(handle_); }
std::int64_t Database::inserted_number() const { return sqlite3_last_insert_rowid(handle_); }

void Database::Fail(int code) {
  const int primary = code & 0xFF;
  const bool system = primary == SQLITE_IOERR || primary == SQLITE_CANTOPEN || primary == SQLITE_PERM;
  const std::string what = handle_ == nullptr ? sqlite3_errstr(code) : sqlite3_errmsg(handle_);
  problem_ = Problem(path_, primary, system && handle_ != nullptr ? sqlite3_system_errno(handle_) : 0, what);
  lost_ = primary == SQLITE_CORRUPT || primary == SQLITE_NOTADB || code == SQLITE_READONLY_DBMOVED;
}

}  // namespace axlecast
