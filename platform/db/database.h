#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/secret.h"
#include "core/base/time.h"
#include "platform/db/copy_rows.h"
#include "platform/db/database_error.h"
#include "platform/db/timeline.h"

struct pg_result;  // libpq

namespace axlecast::db {

class Session;

struct DatabaseSettings {
  // libpq's connection string or URI, without a password. Several hosts ("host=db1,db2") are tried in their order.
  std::string connection{};
  SecretPlace password{};  // read at each Connect; empty: none (peer, certificate, ~/.pgpass)
  // true: only a server that accepts writes is used (target_session_attrs=read-write), unless the string states another one.
  bool writes = true;
  std::string application = "axlecast";  // shown in pg_stat_activity
  int stop = -1;  // a descriptor that becomes readable to end every wait (StopSignal, WakeEvent); -1: none
  MonoNs connect_limit = 5 * kSecond;     // for each host and address
  MonoNs statement_limit = 60 * kSecond;  // for each answer of the server
  MonoNs commit_limit = 20 * kSecond;
  // With `writes`: an old primary is refused, also at later connections that use the same object. Null: only the hosts of one Connect are
  // compared with each other. Must outlive the Database.
  Timelines* timelines = nullptr;
};

// One parameter ($1, $2, …) of a statement. The server derives its type from the statement; write $1::int8[] where it cannot.
class Parameter {
 public:
  [[nodiscard]] static Parameter Null() { return {}; }
  [[nodiscard]] static Parameter Bool(bool value);
  [[nodiscard]] static Parameter Int(std::int64_t value);
  [[nodiscard]] static Parameter Float(double value);  // every value, also NaN, exactly
  [[nodiscard]] static Parameter Text(
      std::string_view value);                         // also jsonb and uuid. Cleaned as CopyRow::Text does
  [[nodiscard]] static Parameter Binary(Bytes value);  // bytea
  [[nodiscard]] static Parameter Timestamp(std::int64_t unix_us);
  // Arrays: write $1::int8[] in the statement. An empty optional is NULL.
  [[nodiscard]] static Parameter Array(std::span<const std::int64_t> values);
  [[nodiscard]] static Parameter Array(std::span<const std::optional<std::int64_t>> values);
  [[nodiscard]] static Parameter Array(std::span<const std::optional<double>> values);
  [[nodiscard]] static Parameter Array(std::span<const std::string> values);  // text[]
  // timestamptz[], from UNIX times in us.
  [[nodiscard]] static Parameter Timestamps(std::span<const std::int64_t> unix_us);

 private:
  friend class Session;
  Parameter() = default;
  explicit Parameter(std::string value) : value_(std::move(value)) {}
  Parameter(std::string value, unsigned type) : value_(std::move(value)), type_(type), binary_(true) {}

  std::optional<std::string> value_;  // nothing: NULL
  unsigned type_ = 0;                 // OID; 0: derived by the server
  bool binary_ = false;
};

using Parameters = std::vector<Parameter>;

// The rows of an answer. Accessors return nothing for NULL, a column that does not exist, and a text that is not of the type.
class Rows {
 public:
  explicit Rows(std::shared_ptr<pg_result> result) : result_(std::move(result)) {}

  [[nodiscard]] int size() const;
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] int columns() const;
  [[nodiscard]] std::string_view name(int column) const;
  [[nodiscard]] bool IsNull(int row, int column) const;
  [[nodiscard]] std::string_view Text(int row, int column) const;  // as PostgreSQL prints it; empty for NULL
  [[nodiscard]] std::optional<bool> Bool(int row, int column) const;
  [[nodiscard]] std::optional<std::int64_t> Int(int row, int column) const;
  [[nodiscard]] std::optional<double> Float(int row, int column) const;  // also NaN and infinite
  [[nodiscard]] std::optional<std::string> Binary(int row, int column) const;
  [[nodiscard]] std::optional<std::int64_t> Timestamp(int row,
                                                      int column) const;  // UNIX time in us; nothing for infinity

 private:
  std::shared_ptr<pg_result> result_;
};

enum class CommitState : std::uint8_t {
  kCommitted,   // on the server's disk, and on its synchronous standby if it has one
  kRolledBack,  // certainly not; `error` states why
  kUnknown,  // no answer, or a warning in place of the standby's acknowledgement: connect again and read the ledger. The
             // connection is closed.
};
struct Commit {
  CommitState state = CommitState::kCommitted;
  DatabaseError error;  // if not kCommitted
};

// A connection to PostgreSQL: the only user of libpq. Calls block, but never longer than the limits of the settings, and end
// when `stop` becomes readable. After kConnectionLost, kTimeLimit and kStopped the connection is closed: call Connect again.
//
// One thread at a time may use an object. Sessions use UTC, and search pg_catalog only: names in statements need their schema.
class Database {
 public:
  // `secrets` must outlive the object.
  Database(DatabaseSettings settings, SecretSource& secrets);
  ~Database();  // closes the connection; what was not committed is rolled back
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  // Connects to the first host that answers and fits, after closing a connection that exists. If several hosts accept writes, that with
  // the newest timeline is used, and a notice names the others.
  [[nodiscard]] DatabaseResult<> Connect();
  void Close();
  [[nodiscard]] bool connected() const;
  [[nodiscard]] std::string host() const;    // of the connection, "" without one
  [[nodiscard]] int server_version() const;  // 150018 is 15.18; 0 without a connection

  // Runs one statement and returns its rows.
  [[nodiscard]] DatabaseResult<Rows> Query(const std::string& sql, const Parameters& parameters = {});
  // Runs one statement and returns the number of rows that it inserted, updated, deleted or selected.
  [[nodiscard]] DatabaseResult<std::int64_t> Execute(const std::string& sql, const Parameters& parameters = {});
  // Runs statements without parameters, separated by semicolons.
  [[nodiscard]] DatabaseResult<> Script(const std::string& sql);
  // Calls `row` for each row while it arrives (argument: Rows with one row), so that an answer of any size needs no memory. If `row`
  // returns false the query is cancelled and the connection closed.
  [[nodiscard]] DatabaseResult<> ForEach(const std::string& sql, const Parameters& parameters,
                                         const std::function<bool(const Rows&)>& row);
  // Appends the rows to "schema.table(column, column)" by binary COPY. Returns their number.
  [[nodiscard]] DatabaseResult<std::int64_t> Copy(const std::string& table_and_columns, const CopyRows& rows);

  [[nodiscard]] DatabaseResult<> Begin();
  [[nodiscard]] Commit CommitTransaction();
  // Ends the transaction. If that fails, the connection is closed, so that the transaction has ended in any case.
  void Rollback();

  // The server's notices and warnings since the last call, one line each.
  [[nodiscard]] std::vector<std::string> TakeNotices();

 private:
  // Keeps the session of the server to write to. Fails with the texts of `errors` and of old primaries if none is left.
  [[nodiscard]] DatabaseResult<> Choose(std::vector<std::unique_ptr<Session>> sessions,
                                        std::vector<DatabaseError> errors);
  template <typename Use>
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> OnSession(Use use);
  void KeepNotices();

  DatabaseSettings settings_;
  SecretSource& secrets_;
  std::unique_ptr<Session> session_;  // empty without a connection
  std::vector<std::string> notices_;
};

}  // namespace axlecast::db
