#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "platform/db/database.h"

namespace axlecast {

// Which database a subcommand uses: CONNECTION and --password-file.
class DatabaseOption {
 public:
  // Adds both to `command`. The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Returns the settings of a connection. `writes`: the server must accept writes.
  [[nodiscard]] db::DatabaseSettings Settings(bool writes, const std::string& application) const;

 private:
  std::string connection_;
  std::string password_file_;
};

// Prints an error of the database. Returns kExitNoAnswer if no server has answered, else kExitBad.
[[nodiscard]] int FailDatabase(const db::DatabaseError& error);

}  // namespace axlecast
