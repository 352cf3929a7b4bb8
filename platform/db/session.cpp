#include "platform/db/session.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "core/base/text.h"

namespace axlecast::db {
namespace {

constexpr std::size_t kCopyPart = std::size_t{64} << 10;  // bytes between two waits
constexpr std::size_t kMaxNotices = 100;

std::string Trimmed(std::string text) {
  while (text.ends_with('\n') || text.ends_with(' ')) text.pop_back();
  return text;
}

std::string Field(const pg_result* result, int field) {
  const char* const text = PQresultErrorField(result, field);
  return text == nullptr ? "" : text;
}

// The message of a failed connection has one line "FATAL:  28P01: password authentication failed …", because the session is verbose:
// libpq has no other way to the SQLSTATE.
struct ConnectionFailure {
  std::string sqlstate;
  std::string text;
};
ConnectionFailure ParseConnectionFailure(std::string text) {
  ConnectionFailure failure;
  for (const std::string_view severity : {"FATAL:  ", "ERROR:  "}) {
    const std::size_t at = text.find(severity);
    constexpr std::size_t kStateSize = 5;
    if (at == std::string::npos || text.size() < at + severity.size() + kStateSize + 2) continue;
    failure.sqlstate = text.substr(at + severity.size(), kStateSize);
    text.erase(at, severity.size() + kStateSize + 2);
    break;
  }
  if (const std::size_t location = text.find("\nLOCATION:"); location != std::string::npos) text.erase(location);
  failure.text = Trimmed(std::move(text));
  std::ranges::replace(failure.text, '\n', ' ');
  return failure;
}

std::string Sentence(std::string text, DatabaseFault fault) {
  const std::string_view remedy = RemedyOf(fault);
  if (remedy.empty()) return text;
  if (!text.ends_with('.')) text += '.';
  return text.append(" ").append(remedy);
}

DatabaseError ErrorOfConnection(const std::string& target, const char* message) {
  ConnectionFailure failure = ParseConnectionFailure(message);
  DatabaseFault fault = FaultOf(failure.sqlstate);
  // These have no SQLSTATE: libpq finds them itself.
  if (failure.text.find("no password supplied") != std::string::npos) fault = DatabaseFault::kCredentials;
  if (failure.text.find("session is read-only") != std::string::npos) fault = DatabaseFault::kReadOnly;
  return {
      {Sentence("no connection to the database " + target + ": " + failure.text, fault)}, fault, failure.sqlstate};
}

std::string LimitText(MonoNs limit) {
  return Text("%.3g s", static_cast<double>(limit) / static_cast<double>(kSecond));
}

}  // namespace

Session::Session(PGconn* connection, int stop, std::string target)
    : connection_(connection, &PQfinish), stop_(stop), target_(std::move(target)) {}

DatabaseResult<std::unique_ptr<Session>> Session::Open(const DatabaseSettings& settings,
                                                       const ConnectionKeywords& target, const Secret& password) {
  // What the string states has priority: libpq takes the last of two equal keywords.
  std::vector<const char*> names;
  std::vector<const char*> values;
  const auto add = [&](const char* name, const char* value) {
    names.push_back(name);
    values.push_back(value);
  };
  add("fallback_application_name", settings.application.c_str());
  add("client_encoding", "UTF8");
  if (settings.writes) add("target_session_attrs", "read-write");
  // A host that has gone without a word is noticed after 40 s, also between statements.
  add("keepalives_idle", "10");
  add("keepalives_interval", "10");
  add("keepalives_count", "3");
  add("tcp_user_timeout", "40000");
  for (const auto& [name, value] : target) add(name.c_str(), value.c_str());
  if (!password.text().empty())
    add("password", password.text().data());  // the text of a std::string: it ends with NUL
  names.push_back(nullptr);
  values.push_back(nullptr);
  PGconn* const connection = PQconnectStartParams(names.data(), values.data(), 0);
  if (connection == nullptr) {
    return tl::unexpected(
        DatabaseError{{"no connection to the database: out of memory"}, DatabaseFault::kOther, ""});
  }
  std::unique_ptr<Session> session(new Session(connection, settings.stop, TargetText(target)));
  if (const auto completed = session->Complete(settings.connect_limit); !completed)
    return tl::unexpected(completed.error());
  return session;
}

DatabaseResult<> Session::Complete(MonoNs limit) {
  PGconn* const connection = connection_.get();
  PQsetErrorVerbosity(connection, PQERRORS_VERBOSE);
  const MonoNs deadline = clock_.Now() + limit;
  PostgresPollingStatusType state = PGRES_POLLING_WRITING;
  while (PQstatus(connection) != CONNECTION_BAD && state != PGRES_POLLING_OK && state != PGRES_POLLING_FAILED) {
    auto waited = Wait(state == PGRES_POLLING_READING ? POLLIN : POLLOUT, deadline, limit);
    if (!waited) return waited;
    state = PQconnectPoll(connection);
  }
  if (PQstatus(connection) != CONNECTION_OK) {
    usable_ = false;
    return tl::unexpected(ErrorOfConnection(target_, PQerrorMessage(connection)));
  }
  PQsetErrorVerbosity(connection, PQERRORS_DEFAULT);
  PQsetNoticeReceiver(connection, &Session::OnNotice, this);
  if (PQsetnonblocking(connection, 1) != 0) return tl::unexpected(Lost());
  return {};
}

DatabaseError Session::Ended(DatabaseFault fault, std::string text) {
  usable_ = false;
  return {{Sentence(std::move(text), fault)}, fault, ""};
}

DatabaseError Session::Lost() {
  std::string reason = Trimmed(PQerrorMessage(connection_.get()));
  std::ranges::replace(reason, '\n', ' ');
  return Ended(DatabaseFault::kConnectionLost, "lost the connection to the database " + target_ + ": " + reason);
}

DatabaseResult<> Session::Wait(short events, MonoNs deadline, MonoNs limit) {
  const int socket = PQsocket(connection_.get());
  if (socket < 0) return tl::unexpected(Lost());
  std::array<pollfd, 2> files{{{socket, events, 0}, {stop_, POLLIN, 0}}};  // poll ignores a descriptor of -1
  const int ready = PollUntil(files, deadline, clock_);
  if (files[1].revents != 0)
    return tl::unexpected(Ended(DatabaseFault::kStopped, "stopped while waiting for the database"));
  if (ready == 0) {
    return tl::unexpected(
        Ended(DatabaseFault::kTimeLimit, "no answer of the database " + target_ + " within " + LimitText(limit)));
  }
  return {};
}

DatabaseResult<> Session::Flush(MonoNs deadline, MonoNs limit) {
  for (;;) {
    const int left = PQflush(connection_.get());
    if (left == 0) return {};
    if (left < 0) return tl::unexpected(Lost());
    // The server may wait until its own messages are read.
    if (auto waited = Wait(POLLIN | POLLOUT, deadline, limit); !waited) return waited;
    if (PQconsumeInput(connection_.get()) == 0) return tl::unexpected(Lost());
  }
}

DatabaseResult<std::shared_ptr<pg_result>> Session::NextResult(MonoNs deadline, MonoNs limit) {
  while (PQisBusy(connection_.get()) != 0) {
    if (const auto waited = Wait(POLLIN, deadline, limit); !waited) return tl::unexpected(waited.error());
    if (PQconsumeInput(connection_.get()) == 0) return tl::unexpected(Lost());
  }
  return std::shared_ptr<pg_result>(PQgetResult(connection_.get()), &PQclear);
}

DatabaseError Session::ErrorOf(const pg_result* result) {
  const std::string sqlstate = Field(result, PG_DIAG_SQLSTATE);
  if (PQstatus(connection_.get()) == CONNECTION_BAD || sqlstate.empty()) return Lost();
  DatabaseError error;
  error.sqlstate = sqlstate;
  error.fault = FaultOf(sqlstate);
  std::string text = "the database reports: " + Field(result, PG_DIAG_MESSAGE_PRIMARY);
  for (const std::string& more : {Field(result, PG_DIAG_MESSAGE_DETAIL), Field(result, PG_DIAG_MESSAGE_HINT)}) {
    if (!more.empty()) text.append(". ").append(more);
  }
  text.append(" (SQLSTATE ").append(sqlstate).append(")");
  error.text = Sentence(std::move(text), error.fault);
  if (error.fault == DatabaseFault::kConnectionLost) usable_ = false;
  return error;
}

DatabaseResult<std::shared_ptr<pg_result>> Session::Finish(MonoNs limit, const Row* row) {
  if (const auto flushed = Flush(clock_.Now() + limit, limit); !flushed) return tl::unexpected(flushed.error());
  std::shared_ptr<pg_result> last;
  std::optional<DatabaseError> failed;
  for (;;) {
    auto result = NextResult(clock_.Now() + limit, limit);
    if (!result) return tl::unexpected(failed ? *failed : result.error());
    if (*result == nullptr) break;
    switch (PQresultStatus(result->get())) {
      case PGRES_SINGLE_TUPLE:
        if (row != nullptr && !(*row)(Rows(*result))) {
          return tl::unexpected(Ended(DatabaseFault::kStopped, "the reader of the rows has stopped"));
        }
        break;
      case PGRES_COMMAND_OK:
      case PGRES_TUPLES_OK:
      case PGRES_EMPTY_QUERY:
        last = std::move(*result);
        break;
      case PGRES_COPY_IN:
        return *result;
      default:
        if (!failed) failed = ErrorOf(result->get());
        if (!usable_) return tl::unexpected(*failed);
    }
  }
  if (failed) return tl::unexpected(*failed);
  if (last == nullptr) return tl::unexpected(Lost());
  return last;
}

DatabaseResult<std::shared_ptr<pg_result>> Session::Run(const std::string& sql, const Parameters& parameters,
                                                        MonoNs limit, const Row* row) {
  std::vector<Oid> types;
  std::vector<const char*> values;
  std::vector<int> lengths;
  std::vector<int> formats;
  for (const Parameter& parameter : parameters) {
    const std::string* const value = parameter.value_ ? &*parameter.value_ : nullptr;
    types.push_back(parameter.type_);
    values.push_back(value != nullptr ? value->c_str() : nullptr);
    lengths.push_back(value != nullptr ? static_cast<int>(value->size()) : 0);
    formats.push_back(parameter.binary_ ? 1 : 0);
  }
  if (PQsendQueryParams(connection_.get(), sql.c_str(), static_cast<int>(parameters.size()), types.data(),
                        values.data(), lengths.data(), formats.data(), 0) == 0) {
    return tl::unexpected(Lost());
  }
  if (row != nullptr && PQsetSingleRowMode(connection_.get()) == 0) return tl::unexpected(Lost());
  return Finish(limit, row);
}

DatabaseResult<std::shared_ptr<pg_result>> Session::RunScript(const std::string& sql, MonoNs limit) {
  if (PQsendQuery(connection_.get(), sql.c_str()) == 0) return tl::unexpected(Lost());
  return Finish(limit);
}

DatabaseResult<> Session::SendData(std::string_view data, MonoNs limit) {
  while (!data.empty()) {
    const std::string_view part = data.substr(0, kCopyPart);
    // 0 and -1 occur if the server has ended the COPY with an error, which Finish returns.
    if (PQputCopyData(connection_.get(), part.data(), static_cast<int>(part.size())) != 1) return {};
    data.remove_prefix(part.size());
    if (auto flushed = Flush(clock_.Now() + limit, limit); !flushed) return flushed;
  }
  return {};
}

DatabaseResult<std::shared_ptr<pg_result>> Session::Copy(const std::string& sql, std::string_view data,
                                                         MonoNs limit) {
  constexpr std::string_view kTrailer("\xFF\xFF", 2);
  auto begun = RunScript(sql, limit);
  if (!begun) return begun;
  for (const std::string_view part : {data, kTrailer}) {
    if (const auto sent = SendData(part, limit); !sent) return tl::unexpected(sent.error());
  }
  if (PQputCopyEnd(connection_.get(), nullptr) < 0 && PQstatus(connection_.get()) == CONNECTION_BAD) {
    return tl::unexpected(Lost());
  }
  return Finish(limit);
}

std::string Session::Warning() const {
  const auto found = std::ranges::find(notices_, "01000", &Notice::sqlstate);
  return found == notices_.end() ? "" : found->text;
}

void Session::OnNotice(void* session, const PGresult* result) {
  auto& notices = static_cast<Session*>(session)->notices_;
  if (notices.size() >= kMaxNotices) notices.erase(notices.begin());
  notices.push_back({Field(result, PG_DIAG_SQLSTATE),
                     Field(result, PG_DIAG_SEVERITY) + ": " + Field(result, PG_DIAG_MESSAGE_PRIMARY)});
}

}  // namespace axlecast::db
