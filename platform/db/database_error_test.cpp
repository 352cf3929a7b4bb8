#include "platform/db/database_error.h"

#include <gtest/gtest.h>

#include <string_view>
#include <utility>

namespace axlecast::db {
namespace {

// States and their meaning: PostgreSQL 15 manual, appendix A.
TEST(DatabaseFault, FollowsFromTheSqlstate) {
  using enum DatabaseFault;
  for (const auto& [sqlstate, fault] : {
           std::pair<std::string_view, DatabaseFault>{"", kConnectionLost},
           {"08006", kConnectionLost},  // connection_failure
           {"08P01", kOther},           // protocol_violation
           {"22003", kBadValue},        // numeric_value_out_of_range
           {"23505", kConstraint},      // unique_violation
           {"23514", kConstraint},      // check_violation: also no partition for a row
           {"25006", kReadOnly},        // read_only_sql_transaction
           {"25P03", kConnectionLost},  // idle_in_transaction_session_timeout
           {"28P01", kCredentials},     // invalid_password
           {"3D000", kNoDatabase},      // invalid_catalog_name
           {"3F000", kNoSchema},        // invalid_schema_name
           {"40001", kTryAgain},        // serialization_failure
           {"40P01", kTryAgain},        // deadlock_detected
           {"40003", kConnectionLost},  // statement_completion_unknown
           {"42501", kPermission},      // insufficient_privilege
           {"42P01", kNoSchema},        // undefined_table
           {"42601", kOther},           // syntax_error
           {"53100", kDiskFull},        // disk_full
           {"53300", kTooBusy},         // too_many_connections
           {"55P03", kTryAgain},        // lock_not_available
           {"57014", kCancelled},       // query_canceled
           {"57P01", kConnectionLost},  // admin_shutdown
           {"57P03", kConnectionLost},  // cannot_connect_now
           {"57P04", kNoDatabase},      // database_dropped
           {"XX000", kOther},           // internal_error
       }) {
    EXPECT_EQ(FaultOf(sqlstate), fault) << sqlstate;
  }
}

TEST(DatabaseFault, OnlyAPersonCuresCredentialsAndSchemas) {
  using enum DatabaseFault;
  for (const auto fault : {kConnectionLost, kTimeLimit, kReadOnly, kTooBusy, kDiskFull, kTryAgain, kCancelled}) {
    EXPECT_TRUE(MayPassLater(fault)) << static_cast<int>(fault);
  }
  for (const auto fault : {kStopped, kCredentials, kPermission, kNoDatabase, kNoSchema, kConstraint, kBadValue,
                           kBadConnection, kOther}) {
    EXPECT_FALSE(MayPassLater(fault)) << static_cast<int>(fault);
  }
}

}  // namespace
}  // namespace axlecast::db
