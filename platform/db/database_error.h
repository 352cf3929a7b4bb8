#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "core/base/result.h"

namespace axlecast::db {

// What a program must do after an error of the database. `FaultOf` derives it from the SQLSTATE (PostgreSQL manual, appendix A).
enum class DatabaseFault : std::uint8_t {
  kConnectionLost,  // no server, it ended, or it is starting or stopping: connect again, then read the ledger again
  kTimeLimit,       // no answer within the time limit; the connection was closed, because the outcome is unknown
  kStopped,         // the stop descriptor became readable; the connection was closed
  kCredentials,     // password, certificate or role refused, or the password's place cannot be read
  kPermission,      // the role may not do this
  kNoDatabase,      // the database does not exist
  kNoSchema,        // a table, function or schema does not exist: `axlecast fleet init` creates them
  kReadOnly,        // a standby, or a transaction that may not write
  kTooBusy,         // no free connection, or out of memory: try again later
  kDiskFull,        // the server's disk is full: try again later
  kTryAgain,        // serialization failure, deadlock, lock not available: run the transaction again
  kConstraint,      // unique, foreign key, check or NOT NULL; also a row without a partition
  kBadValue,        // a value that the column's type does not allow
  kCancelled,       // cancelled by an administrator, or statement_timeout
  kBadConnection,   // the connection string is wrong
  kOther,
};

// An error of the database. The text names what happened, why, and what to change; it never contains a password.
struct DatabaseError : Error {
  DatabaseFault fault = DatabaseFault::kOther;
  std::string sqlstate;  // five characters; empty if the server did not send one
};

// Makes a Result<T> of it: `return Failure(result.error())`.
[[nodiscard]] inline tl::unexpected<Error> Failure(const DatabaseError& error) {
  return axlecast::Failure(error.text, error.reason);
}

// The value of a function of the database that can fail.
template <typename T = void>
using DatabaseResult = tl::expected<T, DatabaseError>;

// Returns the fault of a SQLSTATE; kConnectionLost for an empty one.
[[nodiscard]] DatabaseFault FaultOf(std::string_view sqlstate);

// Returns true if the same transaction can succeed later without a change by a person: after a new connection, or a wait.
[[nodiscard]] bool MayPassLater(DatabaseFault fault);

// Returns what a person should do; empty if the message of the server is enough.
[[nodiscard]] std::string_view RemedyOf(DatabaseFault fault);

}  // namespace axlecast::db
