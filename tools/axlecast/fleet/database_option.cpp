#include "tools/axlecast/fleet/database_option.h"

#include "tools/axlecast/common/terminal.h"

namespace axlecast {

void DatabaseOption::AddTo(CLI::App& command) {
  command.add_option("CONNECTION", connection_, "Connection string or URI of libpq, without a password")
      ->required();
  command.add_option("--password-file", password_file_, "File with the password, which only its owner can read");
}

db::DatabaseSettings DatabaseOption::Settings(bool writes, const std::string& application) const {
  db::DatabaseSettings settings;
  settings.connection = connection_;
  settings.password.file = password_file_;
  settings.writes = writes;
  settings.application = application;
  return settings;
}

int FailDatabase(const db::DatabaseError& error) {
  const bool silent =
      error.fault == db::DatabaseFault::kConnectionLost || error.fault == db::DatabaseFault::kTimeLimit;
  return Fail(error.text, silent ? kExitNoAnswer : kExitBad);
}

}  // namespace axlecast
