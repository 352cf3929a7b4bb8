#pragma once

#include <libpq-fe.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "platform/db/connection_target.h"
#include "platform/db/database.h"
#include "platform/os/system_clock.h"

namespace axlecast::db {

// What the server reports beside an answer.
struct Notice {
  std::string sqlstate;
  std::string text;
};

// One connection of libpq, and every wait on it. After an error with the fault kConnectionLost, kTimeLimit or kStopped it cannot be used
// any more: destroy it.
class Session {
 public:
  // Connects to one host, and to a server that accepts writes if `settings.writes`.
  [[nodiscard]] static DatabaseResult<std::unique_ptr<Session>> Open(const DatabaseSettings& settings,
                                                                     const ConnectionKeywords& target,
                                                                     const Secret& password);
  ~Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  using Row = std::function<bool(const Rows&)>;

  // Runs a statement and returns its last answer. With `row`, each row is given to it while it arrives; a row that it refuses ends the
  // connection.
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> Run(const std::string& sql, const Parameters& parameters,
                                                               MonoNs limit, const Row* row = nullptr);
  // Runs statements without parameters.
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> RunScript(const std::string& sql, MonoNs limit);
  // Runs a COPY FROM STDIN. `limit` is for each part of the data and for the answer.
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> Copy(const std::string& sql, std::string_view data,
                                                                MonoNs limit);

  [[nodiscard]] bool usable() const { return usable_; }
  [[nodiscard]] bool in_transaction() const { return PQtransactionStatus(connection_.get()) != PQTRANS_IDLE; }
  [[nodiscard]] const std::string& target() const { return target_; }  // host, port and database
  [[nodiscard]] const PGconn* connection() const { return connection_.get(); }
  // Returns the first notice of SQLSTATE 01000 (a warning without a class of its own) since TakeNotices; empty without one.
  [[nodiscard]] std::string Warning() const;
  [[nodiscard]] std::vector<Notice> TakeNotices() { return std::exchange(notices_, {}); }

 private:
  Session(PGconn* connection, int stop, std::string target);

  [[nodiscard]] DatabaseResult<> Complete(MonoNs limit);
  [[nodiscard]] DatabaseResult<> Wait(short events, MonoNs deadline, MonoNs limit);
  [[nodiscard]] DatabaseResult<> Flush(MonoNs deadline, MonoNs limit);
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> NextResult(MonoNs deadline, MonoNs limit);
  [[nodiscard]] DatabaseResult<std::shared_ptr<pg_result>> Finish(MonoNs limit, const Row* row = nullptr);
  [[nodiscard]] DatabaseResult<> SendData(std::string_view data, MonoNs limit);
  [[nodiscard]] DatabaseError ErrorOf(const pg_result* result);
  [[nodiscard]] DatabaseError Lost();
  [[nodiscard]] DatabaseError Ended(DatabaseFault fault, std::string text);
  static void OnNotice(void* session, const PGresult* result);

  std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
  int stop_;
  std::string target_;
  bool usable_ = true;
  std::vector<Notice> notices_;
  SystemClock clock_;
};

}  // namespace axlecast::db
