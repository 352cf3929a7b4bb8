#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "platform/db/database.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/database_option.h"
#include "tools/fleet/schema/migration.h"

namespace axlecast {
namespace {

struct InitOptions {
  DatabaseOption database;
  FleetLogins logins;
  bool json = false;
};

std::string MigrationSentence(const Migration& migration) {
  const std::string version = std::to_string(migration.to);
  if (migration.from == migration.to) return "The schema is up to date: version " + version + ".\n";
  if (migration.from == 0) return "Created the schema, version " + version + ".\n";
  return "Migrated the schema from version " + std::to_string(migration.from) + " to " + version + ".\n";
}

std::string LoginSentence(const std::string& login, const std::string& group) {
  if (login.empty()) return "";
  return "User " + login + " is a member of " + group +
         ". It has no password from axlecast; to set one: \\password " + login + " in psql.\n";
}

int RunInit(const InitOptions& options) {
  const StopSignal stop;
  SecretFiles secrets;
  db::DatabaseSettings settings = options.database.Settings(true, "axlecast fleet init");
  settings.stop = stop.FileDescriptor();
  db::Database database(settings, secrets);
  if (const auto connected = database.Connect(); !connected) return FailDatabase(connected.error());
  const int server = database.server_version();
  const auto migration = MigrateSchema(database, options.logins);
  for (const std::string& notice : database.TakeNotices()) {
    if (notice.starts_with("WARNING")) static_cast<void>(Fail(notice, 0));
  }
  if (!migration) return FailDatabase(migration.error());
  const nlohmann::ordered_json json = {{"from", migration->from},
                                       {"version", migration->to},
                                       {"server_version", server},
                                       {"writer", options.logins.writer},
                                       {"reader", options.logins.reader}};
  Show(json,
       MigrationSentence(*migration) + LoginSentence(options.logins.writer, "axlecast_writer") +
           LoginSentence(options.logins.reader, "axlecast_reader"),
       options.json);
  return kExitDone;
}

}  // namespace

void AddFleetInitCommand(CLI::App& fleet, int& exit_code) {
  CLI::App* const command =
      fleet.add_subcommand("init", "Create the tables in a PostgreSQL database, or migrate them");
  const auto options = std::make_shared<InitOptions>();
  options->database.AddTo(*command);
  command->add_option("--writer", options->logins.writer, "Create a user NAME that may ship data")
      ->type_name("NAME");
  command->add_option("--reader", options->logins.reader, "Create a user NAME that may read all data")
      ->type_name("NAME");
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, &exit_code] { exit_code = RunInit(*options); });
}

}  // namespace axlecast
