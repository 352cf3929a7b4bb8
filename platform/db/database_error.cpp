#include "platform/db/database_error.h"

#include <algorithm>
#include <array>
#include <utility>

namespace axlecast::db {
namespace {

struct Entry {
  std::string_view sqlstate;  // or its first two characters, the class
  DatabaseFault fault;
};

// PostgreSQL 15 manual, appendix A. A state of five characters comes before its class.
constexpr std::array kFaults{
    Entry{"08P01", DatabaseFault::kOther},  // protocol violation: an answer of a living server
    Entry{"08", DatabaseFault::kConnectionLost},
    Entry{"22", DatabaseFault::kBadValue},
    Entry{"23", DatabaseFault::kConstraint},
    Entry{"25006", DatabaseFault::kReadOnly},
    Entry{"25P03", DatabaseFault::kConnectionLost},  // idle_in_transaction_session_timeout
    Entry{"28", DatabaseFault::kCredentials},
    Entry{"3D000", DatabaseFault::kNoDatabase},
    Entry{"3F000", DatabaseFault::kNoSchema},
    Entry{"40003", DatabaseFault::kConnectionLost},  // statement completion unknown
    Entry{"40", DatabaseFault::kTryAgain},
    Entry{"42501", DatabaseFault::kPermission},
    Entry{"42P01", DatabaseFault::kNoSchema},  // undefined table
    Entry{"42883", DatabaseFault::kNoSchema},  // undefined function
    Entry{"42703", DatabaseFault::kNoSchema},  // undefined column
    Entry{"53100", DatabaseFault::kDiskFull},
    Entry{"53", DatabaseFault::kTooBusy},
    Entry{"55P03", DatabaseFault::kTryAgain},  // lock not available
    Entry{"57014", DatabaseFault::kCancelled},
    Entry{"57P04", DatabaseFault::kNoDatabase},  // database dropped
    Entry{"57P", DatabaseFault::kConnectionLost},
    Entry{"58030", DatabaseFault::kDiskFull},  // I/O error of the server
};

}  // namespace

DatabaseFault FaultOf(std::string_view sqlstate) {
  if (sqlstate.empty()) return DatabaseFault::kConnectionLost;
  const auto* const found =
      std::ranges::find_if(kFaults, [&](const Entry& entry) { return sqlstate.starts_with(entry.sqlstate); });
  return found == kFaults.end() ? DatabaseFault::kOther : found->fault;
}

bool MayPassLater(DatabaseFault fault) {
  switch (fault) {
    case DatabaseFault::kConnectionLost:
    case DatabaseFault::kTimeLimit:
    case DatabaseFault::kReadOnly:
    case DatabaseFault::kTooBusy:
    case DatabaseFault::kDiskFull:
    case DatabaseFault::kTryAgain:
    case DatabaseFault::kCancelled:
      return true;
    default:
      return false;
  }
}

std::string_view RemedyOf(DatabaseFault fault) {
  switch (fault) {
    case DatabaseFault::kConnectionLost:
      return "Check that the server runs, and host and port of the connection string.";
    case DatabaseFault::kTimeLimit:
      return "Check the network and the load of the server; a commit may wait for a standby.";
    case DatabaseFault::kCredentials:
      return "Check the user and the password file, and pg_hba.conf on the server.";
    case DatabaseFault::kPermission:
      return "Use a user with the role axlecast_writer (or axlecast_reader to read); the owner of the schema for "
             "axlecast fleet init.";
    case DatabaseFault::kNoDatabase:
      return "Create the database (createdb NAME), or correct dbname in the connection string.";
    case DatabaseFault::kNoSchema:
      return "Run axlecast fleet init CONNECTION to create or migrate the tables.";
    case DatabaseFault::kReadOnly:
      return "Connect to the primary: name every host of the pair in the connection string.";
    case DatabaseFault::kTooBusy:
      return "Raise max_connections or the memory of the server, or use fewer connections.";
    case DatabaseFault::kDiskFull:
      return "Free space on the server's disk, or shorten the retention (docs/fleet.md).";
    case DatabaseFault::kBadConnection:
      return "Example: \"host=db1,db2 dbname=axlecast user=axlecast_press\".";
    default:
      return "";
  }
}

}  // namespace axlecast::db
