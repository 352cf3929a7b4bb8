#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "platform/db/database.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/local_server.h"
#include "tools/fleet/schema/migration.h"

namespace axlecast {
namespace {

constexpr const char* kDatabase = "axlecast";
constexpr const char* kDefaultFolder = "fleet";

// Waits until the server accepts connections: at once, or after it has recovered from a crash.
Result<> ConnectWhenReady(db::Database& database, LocalServer& server, const StopSignal& stop) {
  for (;;) {
    const auto connected = database.Connect();
    if (connected) return {};
    if (connected.error().fault != db::DatabaseFault::kConnectionLost) return Failure(connected.error());
    if (Result<> runs = server.Poll(); !runs) return runs;
    if (stop.Requested()) return Failure("stopped before the server was ready");
  }
}

db::DatabaseSettings SettingsOf(const LocalServer& server, const StopSignal& stop, const std::string& database) {
  db::DatabaseSettings settings;
  settings.connection = server.Connection() + " dbname=" + database;
  settings.application = "axlecast fleet up";
  settings.stop = stop.FileDescriptor();
  return settings;
}

// Creates the database and its schema if they are missing.
Result<> Prepare(LocalServer& server, const StopSignal& stop) {
  SecretFiles secrets;
  db::Database maintenance(SettingsOf(server, stop, "postgres"), secrets);
  if (Result<> ready = ConnectWhenReady(maintenance, server, stop); !ready) return ready;
  const auto exists =
      maintenance.Query("SELECT 1 FROM pg_database WHERE datname = $1", {db::Parameter::Text(kDatabase)});
  if (!exists) return Failure(exists.error());
  if (exists->empty()) {
    const auto created = maintenance.Script(std::string("CREATE DATABASE ") + kDatabase);
    if (!created) return Failure(created.error());
  }
  db::Database fleet(SettingsOf(server, stop, kDatabase), secrets);
  if (Result<> ready = ConnectWhenReady(fleet, server, stop); !ready) return ready;
  if (const auto migrated = MigrateSchema(fleet, {}); !migrated) return Failure(migrated.error());
  return {};
}

int RunUp(LocalServerSettings settings) {
  std::error_code error;
  settings.folder = std::filesystem::absolute(settings.folder, error).lexically_normal();
  while (settings.folder.size() > 1 && settings.folder.ends_with('/')) settings.folder.pop_back();
  const StopSignal stop;
  const int port = settings.port;
  LocalServer server(std::move(settings));
  if (const Result<> started = server.Start(stop); !started) return Fail(started.error().text, kExitBad);
  if (const Result<> prepared = Prepare(server, stop); !prepared) {
    server.Stop(stop);
    return stop.Requested() ? kExitDone : Fail(prepared.error().text, kExitFailed);
  }
  const std::string connection = server.Connection() + " dbname=" + kDatabase;
  static_cast<void>(WriteOut("connection: " + connection + "\n" + "log:        " + server.log() + "\n"));
  if (port != 0) {
    static_cast<void>(WriteOut("127.0.0.1:" + std::to_string(port) +
                               " asks for a password, which a user has after \\password in: psql \"" + connection +
                               "\"\n"));
  }
  static_cast<void>(WriteOut("Ctrl-C ends the server.\n"));
  while (!stop.Requested()) {
    if (const Result<> runs = server.Poll(); !runs) return Fail(runs.error().text, kExitFailed);
  }
  server.Stop(stop);
  return kExitDone;
}

}  // namespace

void AddFleetUpCommand(CLI::App& fleet, int& exit_code) {
  CLI::App* const command =
      fleet.add_subcommand("up", "Run a PostgreSQL server with a fleet database in the foreground, for a desk");
  const auto settings = std::make_shared<LocalServerSettings>();
  settings->folder = kDefaultFolder;
  command->add_option("FOLDER", settings->folder, "Folder of the data and of the socket; made if it is missing")
      ->capture_default_str();
  command->add_option("--port", settings->port, "Listen on 127.0.0.1 as well, on this TCP port")
      ->check(CLI::Range(1, 65535))
      ->type_name("PORT");
  command->add_option("--user", settings->user, "Run the server as this user, if the command is run as root")
      ->type_name("NAME");
  command->callback([settings, &exit_code] { exit_code = RunUp(*settings); });
}

}  // namespace axlecast
