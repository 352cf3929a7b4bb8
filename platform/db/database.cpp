#include "platform/db/database.h"

#include <libpq-fe.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "platform/db/session.h"
#include "platform/db/value_text.h"

namespace axlecast::db {
namespace {

constexpr unsigned kTimestamptz = 1184;  // OIDs of pg_type.dat
constexpr unsigned kBytea = 17;
constexpr MonoNs kRollbackLimit = 5 * kSecond;

// Sessions are alike whatever the server's and the role's settings are. A backend whose client has gone ends by itself, and with it its
// locks on the ledger.
constexpr const char* kSessionSettings =
    "SET TimeZone = 'UTC'; SET DateStyle = 'ISO'; SET bytea_output = 'hex'; SET extra_float_digits = 1;"
    "SET search_path = pg_catalog; SET client_connection_check_interval = '10s'; SET statement_timeout = 0;"
    "SET idle_in_transaction_session_timeout = '10min'";

template <typename T, typename Format>
std::string ArrayText(std::span<const T> values, Format format) {
  std::string text = "{";
  for (const T& value : values) {
    if (text.size() > 1) text += ',';
    text += format(value);
  }
  return text + '}';
}

template <typename T>
std::optional<T> ParseNumber(std::string_view text) {
  T number{};
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || rest != text.data() + text.size()) return std::nullopt;
  return number;
}

// The number of rows of an answer's command tag.
std::int64_t AffectedRows(pg_result* result) { return std::strtoll(PQcmdTuples(result), nullptr, 10); }

DatabaseError NotConnected() {
  return {{"there is no connection to the database"}, DatabaseFault::kConnectionLost, ""};
}

// One error for several hosts: the first that a later attempt does not cure decides.
DatabaseError Joined(const std::vector<DatabaseError>& errors) {
  const auto decisive = std::ranges::find_if(errors, [](const auto& error) { return !MayPassLater(error.fault); });
  DatabaseError joined = decisive == errors.end() ? errors.front() : *decisive;
  joined.text.clear();
  for (const DatabaseError& error : errors) joined.text.append(joined.text.empty() ? "" : "; ").append(error.text);
  return joined;
}

}  // namespace

Parameter Parameter::Bool(bool value) { return Parameter(value ? "t" : "f"); }
Parameter Parameter::Int(std::int64_t value) { return Parameter(std::to_string(value)); }
Parameter Parameter::Float(double value) { return Parameter(FloatText(value)); }
Parameter Parameter::Text(std::string_view value) { return Parameter(DatabaseText(value)); }
Parameter Parameter::Binary(Bytes value) { return {std::string(value.begin(), value.end()), kBytea}; }

Parameter Parameter::Timestamp(std::int64_t unix_us) {
  std::string bytes;
  for (int shift = 56; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<char>(static_cast<std::uint64_t>(PostgresMicroseconds(unix_us)) >> shift));
  }
  return {std::move(bytes), kTimestamptz};
}

Parameter Parameter::Array(std::span<const std::int64_t> values) {
  return Parameter(ArrayText(values, [](std::int64_t value) { return std::to_string(value); }));
}
Parameter Parameter::Array(std::span<const std::optional<std::int64_t>> values) {
  return Parameter(ArrayText(values, [](const auto& value) { return value ? std::to_string(*value) : "NULL"; }));
}
Parameter Parameter::Array(std::span<const std::optional<double>> values) {
  return Parameter(ArrayText(values, [](const auto& value) { return value ? FloatText(*value) : "NULL"; }));
}
Parameter Parameter::Array(std::span<const std::string> values) {
  return Parameter(ArrayText(values, &QuotedElement));
}
Parameter Parameter::Timestamps(std::span<const std::int64_t> unix_us) {
  return Parameter(ArrayText(unix_us, [](std::int64_t time) { return QuotedElement(DatabaseTimeText(time)); }));
}

int Rows::size() const { return PQntuples(result_.get()); }
int Rows::columns() const { return PQnfields(result_.get()); }

std::string_view Rows::name(int column) const {
  const char* const name = PQfname(result_.get(), column);
  return name == nullptr ? std::string_view() : name;
}

bool Rows::IsNull(int row, int column) const {
  if (row < 0 || row >= size() || column < 0 || column >= columns()) return true;
  return PQgetisnull(result_.get(), row, column) != 0;
}

std::string_view Rows::Text(int row, int column) const {
  if (IsNull(row, column)) return {};
  return {PQgetvalue(result_.get(), row, column),
          static_cast<std::size_t>(PQgetlength(result_.get(), row, column))};
}

std::optional<bool> Rows::Bool(int row, int column) const {
  const std::string_view text = Text(row, column);
  if (text != "t" && text != "f") return std::nullopt;
  return text == "t";
}

std::optional<std::int64_t> Rows::Int(int row, int column) const {
  return ParseNumber<std::int64_t>(Text(row, column));
}
std::optional<double> Rows::Float(int row, int column) const { return ParseNumber<double>(Text(row, column)); }
std::optional<std::string> Rows::Binary(int row, int column) const { return ParseBytea(Text(row, column)); }
std::optional<std::int64_t> Rows::Timestamp(int row, int column) const {
  return ParseDatabaseTime(Text(row, column));
}

Database::Database(DatabaseSettings settings, SecretSource& secrets)
    : settings_(std::move(settings)), secrets_(secrets) {}
Database::~Database() = default;

DatabaseResult<> Database::Connect() {
  Close();
  const auto hosts = SplitHosts(settings_.connection);
  if (!hosts) return tl::unexpected(hosts.error());
  Secret password;
  if (!settings_.password.empty()) {
    Result<Secret> read = secrets_.Read(settings_.password);
    if (!read) return tl::unexpected(DatabaseError{read.error(), DatabaseFault::kCredentials, ""});
    password = std::move(*read);
  }
  // One host is compared with what was seen before; several with each other as well.
  const bool compares = settings_.writes && (hosts->size() > 1 || settings_.timelines != nullptr);
  std::vector<DatabaseError> errors;
  std::vector<std::unique_ptr<Session>> sessions;
  for (const ConnectionKeywords& host : *hosts) {
    auto session = Session::Open(settings_, host, password);
    if (session) {
      sessions.push_back(std::move(*session));
      if (!compares) break;
      continue;
    }
    errors.push_back(session.error());
    if (session.error().fault == DatabaseFault::kStopped) return tl::unexpected(session.error());
  }
  if (compares && !sessions.empty()) {
    if (auto chosen = Choose(std::move(sessions), std::move(errors)); !chosen) return chosen;
  } else if (!sessions.empty()) {
    session_ = std::move(sessions.front());
  } else {
    return tl::unexpected(Joined(errors));
  }
  auto configured = Script(kSessionSettings);
  if (!configured) Close();
  return configured;
}

DatabaseResult<> Database::Choose(std::vector<std::unique_ptr<Session>> sessions,
                                  std::vector<DatabaseError> errors) {
  std::vector<ServerTimeline> servers;
  for (const auto& session : sessions) {
    const auto result = session->Run(kTimelineQuery, {}, settings_.statement_limit);
    // Without the right to call these functions, the timeline is unknown.
    servers.emplace_back();
    if (!result) continue;
    const Rows rows(*result);
    servers.back() = {std::string(rows.Text(0, 0)), rows.Int(0, 1).value_or(0)};
  }
  Timelines of_this_connect;
  Timelines& seen = settings_.timelines != nullptr ? *settings_.timelines : of_this_connect;
  const auto chosen = ChooseServer(servers, seen);
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    if (servers[i].timeline == 0 || servers[i].timeline == seen[servers[i].system]) continue;
    std::string text = OldPrimaryText(sessions[i]->target(), servers[i], seen);
    if (chosen) {
      notices_.push_back(std::move(text));
    } else {
      errors.push_back({{std::move(text)}, DatabaseFault::kReadOnly, ""});
    }
  }
  if (!chosen) return tl::unexpected(Joined(errors));
  session_ = std::move(sessions[*chosen]);
  return {};
}

void Database::Close() {
  KeepNotices();
  session_.reset();
}

bool Database::connected() const { return session_ != nullptr; }

std::string Database::host() const {
  const char* const host = session_ ? PQhost(session_->connection()) : nullptr;
  return host == nullptr ? "" : host;
}

int Database::server_version() const { return session_ ? PQserverVersion(session_->connection()) : 0; }

template <typename Use>
DatabaseResult<std::shared_ptr<pg_result>> Database::OnSession(Use use) {
  if (!session_) return tl::unexpected(NotConnected());
  DatabaseResult<std::shared_ptr<pg_result>> result = use(*session_);
  KeepNotices();
  if (!session_->usable()) session_.reset();
  return result;
}

DatabaseResult<Rows> Database::Query(const std::string& sql, const Parameters& parameters) {
  return OnSession([&](Session& session) { return session.Run(sql, parameters, settings_.statement_limit); })
      .map([](auto result) { return Rows(std::move(result)); });
}

DatabaseResult<std::int64_t> Database::Execute(const std::string& sql, const Parameters& parameters) {
  return OnSession([&](Session& session) { return session.Run(sql, parameters, settings_.statement_limit); })
      .map([](const auto& result) { return AffectedRows(result.get()); });
}

DatabaseResult<> Database::Script(const std::string& sql) {
  return OnSession([&](Session& session) { return session.RunScript(sql, settings_.statement_limit); })
      .map([](const auto&) {});
}

DatabaseResult<> Database::ForEach(const std::string& sql, const Parameters& parameters,
                                   const std::function<bool(const Rows&)>& row) {
  return OnSession([&](Session& session) { return session.Run(sql, parameters, settings_.statement_limit, &row); })
      .map([](const auto&) {});
}

DatabaseResult<std::int64_t> Database::Copy(const std::string& table_and_columns, const CopyRows& rows) {
  const std::string sql = "COPY " + table_and_columns + " FROM STDIN (FORMAT binary)";
  return OnSession([&](Session& session) { return session.Copy(sql, rows.encoded(), settings_.statement_limit); })
      .map([](const auto& result) { return AffectedRows(result.get()); });
}

DatabaseResult<> Database::Begin() { return Script("BEGIN"); }

Commit Database::CommitTransaction() {
  KeepNotices();
  std::string warning;
  const auto result = OnSession([&](Session& session) {
    auto answer = session.Run("COMMIT", {}, settings_.commit_limit);
    warning = session.Warning();
    return answer;
  });
  if (!result) {
    const bool answered = session_ != nullptr;
    return {answered ? CommitState::kRolledBack : CommitState::kUnknown, result.error()};
  }
  // A cancelled wait for the standby: the transaction is on this server only, and is lost if the standby takes over.
  if (!warning.empty()) {
    Close();
    return {
        CommitState::kUnknown,
        {{"the database has not acknowledged the commit: " + warning}, DatabaseFault::kConnectionLost, "01000"}};
  }
  if (std::string_view(PQcmdStatus(result->get())) != "COMMIT") {
    return {CommitState::kRolledBack,
            {{"the database has rolled the transaction back, because a statement in it has failed"},
             DatabaseFault::kOther,
             ""}};
  }
  return {};
}

void Database::Rollback() {
  if (!session_ || !session_->in_transaction()) return;
  const auto result = OnSession([](Session& session) { return session.RunScript("ROLLBACK", kRollbackLimit); });
  if (!result) Close();
}

std::vector<std::string> Database::TakeNotices() { return std::exchange(notices_, {}); }

void Database::KeepNotices() {
  if (!session_) return;
  for (Notice& notice : session_->TakeNotices()) notices_.push_back(std::move(notice.text));
  constexpr std::ptrdiff_t kMaxNotices = 100;
  const auto excess = std::ssize(notices_) - kMaxNotices;
  if (excess > 0) notices_.erase(notices_.begin(), notices_.begin() + excess);
}

}  // namespace axlecast::db
