#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "platform/db/database.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/fleet/read/fleet_reader.h"

namespace axlecast {

// The connection to the fleet database, found in the same way by every subcommand of `fleet`: --database CONNECTION, else
// $AXLECAST_DATABASE, else `ship.database` of the machine's file (--config FILE, or a default of ConfigOption).
class FleetConnection {
 public:
  // Adds --database, --password-file and --config to `command`. The object must outlive the parsing.
  void AddTo(CLI::App& command);

  // Returns the settings of the connection. `writes`: only a server that accepts writes is used.
  [[nodiscard]] Result<db::DatabaseSettings> Settings(bool writes);

  // Returns `given`, or, if it is empty and the connection is from the machine's file, the name of that machine. Call it after
  // Settings. Fails if neither states a name.
  [[nodiscard]] Result<std::string> MachineName(const std::string& given) const;

 private:
  std::string connection_;
  std::string password_file_;
  ConfigOption config_;
  std::string machine_;  // of the file, if it was read
};

// Prints why the reader could not be used. Returns kExitNoAnswer if no server has answered, else kExitBad.
[[nodiscard]] int FailReader(const FleetReader& reader, const Error& error);

inline constexpr const char* kConnectionHelp =
    "The database: --database CONNECTION, else $AXLECAST_DATABASE, else ship.database of the machine's file. The\n"
    "password: --password-file, else ship.password of that file, else ~/.pgpass.\n";

}  // namespace axlecast
