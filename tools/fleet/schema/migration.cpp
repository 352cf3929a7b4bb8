#include "tools/fleet/schema/migration.h"

#include <utility>

namespace axlecast {
namespace {

using db::Database;
using db::DatabaseError;
using db::DatabaseFault;
using db::DatabaseResult;
using db::Parameter;

constexpr int kOldestServer = 150000;  // UNIQUE NULLS NOT DISTINCT came with 15

tl::unexpected<DatabaseError> SchemaFailure(std::string text) {
  return tl::unexpected(DatabaseError{{std::move(text)}, DatabaseFault::kNoSchema, ""});
}

std::string NewerText(int found) {
  return "the fleet database has schema version " + std::to_string(found) +
         ", and this program knows versions up to " + std::to_string(SchemaVersion()) +
         ": install the axlecast that migrated it, or a newer one";
}

// Returns the version of the schema; 0 without a schema.
DatabaseResult<int> FoundVersion(Database& database) {
  const auto found = database.Query(
      "SELECT to_regnamespace('axlecast') IS NOT NULL, to_regclass('axlecast.schema_version') IS NOT NULL");
  if (!found) return tl::unexpected(found.error());
  const bool schema = found->Bool(0, 0).value_or(false);
  if (!found->Bool(0, 1).value_or(false)) {
    if (!schema) return 0;
    return SchemaFailure(
        "the database has a schema `axlecast` that this program has not created: rename it (ALTER SCHEMA axlecast "
        "RENAME TO …), "
        "or use another database");
  }
  const auto version = database.Query("SELECT coalesce(max(version), 0) FROM axlecast.schema_version");
  if (!version) return tl::unexpected(version.error());
  return static_cast<int>(version->Int(0, 0).value_or(0));
}

DatabaseResult<> RunMigrations(Database& database, int from) {
  for (int version = from + 1; version <= SchemaVersion(); ++version) {
    const MigrationText& text = MigrationTexts()[static_cast<std::size_t>(version - 1)];
    if (auto done = database.Script(std::string(text.sql)); !done) {
      done.error().text.insert(0, "migration " + std::string(text.file) + " failed, and nothing was changed: ");
      return done;
    }
    const auto noted = database.Execute("INSERT INTO axlecast.schema_version (version, axlecast) VALUES ($1, $2)",
                                        {Parameter::Int(version), Parameter::Text(AXLECAST_VERSION)});
    if (!noted) return tl::unexpected(noted.error());
  }
  return {};
}

DatabaseResult<> GrantLogin(Database& database, const std::string& login, const std::string& group) {
  if (login.empty()) return {};
  // The statement is composed by the server, which quotes the names.
  const auto statements = database.Query(
      "SELECT CASE WHEN EXISTS (SELECT FROM pg_roles WHERE rolname = $1) THEN '' ELSE format('CREATE ROLE %I "
      "LOGIN;', $1) END || "
      "format('GRANT %I TO %I', $2::text, $1)",
      {Parameter::Text(login), Parameter::Text(group)});
  if (!statements) return tl::unexpected(statements.error());
  return database.Script(std::string(statements->Text(0, 0)));
}

DatabaseResult<Migration> Migrate(Database& database, const FleetLogins& logins) {
  // Released by the end of the transaction.
  if (const auto locked = database.Execute("SELECT pg_advisory_xact_lock(hashtext('axlecast.migrate'))"); !locked) {
    return tl::unexpected(locked.error());
  }
  const auto found = FoundVersion(database);
  if (!found) return tl::unexpected(found.error());
  if (*found > SchemaVersion()) return SchemaFailure(NewerText(*found));
  if (const auto run = RunMigrations(database, *found); !run) return tl::unexpected(run.error());
  if (const auto writer = GrantLogin(database, logins.writer, "axlecast_writer"); !writer)
    return tl::unexpected(writer.error());
  if (const auto reader = GrantLogin(database, logins.reader, "axlecast_reader"); !reader)
    return tl::unexpected(reader.error());
  return Migration{*found, SchemaVersion()};
}

}  // namespace

int SchemaVersion() { return static_cast<int>(MigrationTexts().size()); }

DatabaseResult<Migration> MigrateSchema(Database& database, const FleetLogins& logins) {
  if (const int server = database.server_version(); server < kOldestServer) {
    return tl::unexpected(DatabaseError{{"the server is PostgreSQL " + std::to_string(server / 10000) +
                                         ", and the fleet database needs 15 or later: use a newer server"},
                                        DatabaseFault::kOther,
                                        ""});
  }
  if (const auto begun = database.Begin(); !begun) return tl::unexpected(begun.error());
  auto migration = Migrate(database, logins);
  if (!migration) {
    database.Rollback();
    return migration;
  }
  if (const db::Commit commit = database.CommitTransaction(); commit.state != db::CommitState::kCommitted) {
    return tl::unexpected(commit.error);
  }
  return migration;
}

DatabaseResult<> CheckSchema(Database& database) {
  const auto found = FoundVersion(database);
  if (!found) return tl::unexpected(found.error());
  if (*found == SchemaVersion()) return {};
  if (*found > SchemaVersion()) return SchemaFailure(NewerText(*found));
  if (*found == 0)
    return SchemaFailure("the database has no schema of axlecast: run axlecast fleet init CONNECTION");
  return SchemaFailure("the fleet database has schema version " + std::to_string(*found) +
                       ", and this program needs " + std::to_string(SchemaVersion()) +
                       ": run axlecast fleet init CONNECTION, which keeps all data");
}

}  // namespace axlecast
