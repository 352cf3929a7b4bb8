#include "tools/axlecast/fleet/fleet_connection.h"

#include <cstdlib>
#include <filesystem>

#include "tools/axlecast/common/terminal.h"

namespace axlecast {

void FleetConnection::AddTo(CLI::App& command) {
  command
      .add_option("--database", connection_, "Connect to this database: \"host=db1 dbname=axlecast user=reader\"")
      ->type_name("CONNECTION");
  command
      .add_option("--password-file", password_file_, "Read the password from FILE, which only its owner can read")
      ->type_name("FILE");
  config_.AddTo(command, ConfigOption::Form::kOptionOnly);
}

Result<db::DatabaseSettings> FleetConnection::Settings(bool writes) {
  db::DatabaseSettings settings;
  settings.writes = writes;
  settings.application = "axlecast fleet";
  settings.statement_limit = 600 * kSecond;  // a person waits, and can press Ctrl-C
  const char* const environment = std::getenv("AXLECAST_DATABASE");
  if (!connection_.empty()) {
    settings.connection = connection_;
  } else if (environment != nullptr && *environment != 0) {
    settings.connection = environment;
  } else if (config_.File().empty()) {
    return Failure(
        "no database is named: add --database \"host=... dbname=axlecast\", set AXLECAST_DATABASE, or give the "
        "machine's file "
        "with ship.database by --config");
  } else {
    const auto machine = config_.Load();
    if (!machine) return Failure(machine.error());
    if (machine->ship.database.empty()) {
      return Failure(config_.File() + " has no ship.database: add it, or name the database with --database");
    }
    settings.connection = machine->ship.database;
    settings.password = machine->ship.password;
    machine_ = machine->machine;
  }
  if (!password_file_.empty()) {
    settings.password = {
        .file = std::filesystem::absolute(password_file_).string(), .credential = {}, .group_may_read = true};
  }
  return settings;
}

Result<std::string> FleetConnection::MachineName(const std::string& given) const {
  if (!given.empty()) return given;
  if (!machine_.empty()) return machine_;
  return Failure("no machine is named: add --machine NAME; `axlecast fleet status` lists the machines");
}

int FailReader(const FleetReader& reader, const Error& error) {
  return Fail(error.text, reader.no_answer() ? kExitNoAnswer : kExitBad);
}

}  // namespace axlecast
