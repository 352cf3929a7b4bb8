#include "platform/db/database.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "platform/os/descriptor.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/temporary_folder.h"

namespace axlecast::db {
namespace {

// The superuser's connection to a server of this test's own: tests/fleet/cluster.py.
std::string TestConnection() {
  const char* const connection = std::getenv("AXLECAST_TEST_DATABASE");
  return connection == nullptr ? "" : connection;
}

class DatabaseTest : public ::testing::Test {
 protected:
  DatabaseTest() : database_({.connection = TestConnection()}, secrets_) {
    const auto connected = database_.Connect();
    EXPECT_TRUE(connected) << ErrorText(connected) << " (run it by tests/fleet/cluster.py)";
  }

  template <typename T>
  static std::string ErrorText(const DatabaseResult<T>& result) {
    return result ? "" : result.error().text;
  }
  // Runs statements that must succeed.
  void Must(const std::string& sql) {
    const auto done = database_.Script(sql);
    ASSERT_TRUE(done) << ErrorText(done);
  }
  std::int64_t Number(Database& database, const std::string& sql) {
    const auto rows = database.Query(sql);
    EXPECT_TRUE(rows) << ErrorText(rows);
    return rows ? rows->Int(0, 0).value_or(-1) : -1;
  }

  FixedSecrets secrets_;
  Database database_;
};

TEST_F(DatabaseTest, ValuesPassBothWays) {
  const std::vector<std::uint8_t> bytes{0, 255, 92};
  constexpr std::int64_t kTime = 1'795'776'587'123'456;
  const auto rows = database_.Query(
      "SELECT $1::bool, $2::int8, $3::float8, $4::text, $5::bytea, $6::timestamptz, $7::text, $2::int8 AS named",
      {Parameter::Bool(true), Parameter::Int(INT64_MIN), Parameter::Float(0.1), Parameter::Text("a\"\\{é"),
       Parameter::Binary(bytes), Parameter::Timestamp(kTime), Parameter::Null()});
  ASSERT_TRUE(rows) << ErrorText(rows);
  ASSERT_EQ(rows->size(), 1);
  ASSERT_EQ(rows->columns(), 8);
  EXPECT_EQ(rows->Bool(0, 0), true);
  EXPECT_EQ(rows->Int(0, 1), INT64_MIN);
  EXPECT_EQ(rows->Float(0, 2), 0.1);
  EXPECT_EQ(rows->Text(0, 3), "a\"\\{é");
  EXPECT_EQ(rows->Binary(0, 4), std::string("\0\xff\\", 3));
  EXPECT_EQ(rows->Timestamp(0, 5), kTime);
  EXPECT_TRUE(rows->IsNull(0, 6));
  EXPECT_EQ(rows->name(7), "named");
  EXPECT_EQ(rows->Int(0, 3), std::nullopt);  // not a number
  EXPECT_EQ(rows->Int(0, 6), std::nullopt);  // NULL
  EXPECT_EQ(rows->Int(1, 0), std::nullopt);  // no such row
  EXPECT_EQ(rows->Text(0, 99), "");          // no such column
}

TEST_F(DatabaseTest, ArraysPassAndUnnest) {
  const std::vector<std::optional<std::int64_t>> counts{INT64_MAX, std::nullopt};
  const std::vector<std::optional<double>> means{std::nan(""), std::nullopt};
  const std::vector<std::string> names{"a,\"\\b", ""};
  const std::vector<std::int64_t> times{-1, 1'795'776'587'123'456};
  const auto rows = database_.Query(
      "SELECT * FROM unnest($1::int8[], $2::float8[], $3::text[], $4::timestamptz[])",
      {Parameter::Array(counts), Parameter::Array(means), Parameter::Array(names), Parameter::Timestamps(times)});
  ASSERT_TRUE(rows) << ErrorText(rows);
  ASSERT_EQ(rows->size(), 2);
  EXPECT_EQ(rows->Int(0, 0), INT64_MAX);
  EXPECT_TRUE(rows->IsNull(1, 0));
  EXPECT_TRUE(std::isnan(rows->Float(0, 1).value_or(0)));
  EXPECT_TRUE(rows->IsNull(1, 1));
  EXPECT_EQ(rows->Text(0, 2), names[0]);
  EXPECT_FALSE(rows->IsNull(1, 2));
  EXPECT_EQ(rows->Timestamp(0, 3), times[0]);
  EXPECT_EQ(rows->Timestamp(1, 3), times[1]);
}

TEST_F(DatabaseTest, CopyWritesEveryType) {
  Must(
      "CREATE TEMPORARY TABLE every(b bool, i2 int2, i4 int4, i8 int8, f4 float4, f8 float8, s text, y bytea, t "
      "timestamptz, j jsonb,"
      " u uuid, a int8[], n int4)");
  const std::array<std::uint8_t, 2> bytes{0, 255};
  const std::array<std::uint8_t, 16> uuid{0x00, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77,
                                          0x88, 0x99, 0xaa, 0xbb, 0xcc, 0xdd, 0xee, 0xff};
  const std::vector<std::int64_t> values{1, -1};
  CopyRows rows(13);
  rows.Row()
      .Bool(false)
      .Int2(-1)
      .Int4(-2)
      .Int8(INT64_MIN)
      .Float4(0.5F)
      .Float8(std::nan(""))
      .Text(std::string_view("\0x", 2))
      .Binary(bytes)
      .Timestamp(INT64_MIN)
      .Jsonb(R"({"a":"\u0000"})")
      .Uuid(uuid)
      .Int8Array(values)
      .Null();
  const auto copied = database_.Copy("every", rows);
  ASSERT_TRUE(copied) << ErrorText(copied);
  EXPECT_EQ(*copied, 1);
  const auto back = database_.Query("SELECT every::text FROM every");
  ASSERT_TRUE(back) << ErrorText(back);
  EXPECT_EQ(back->Text(0, 0),
            "(f,-1,-2,-9223372036854775808,0.5,NaN,\uFFFDx,\"\\\\x00ff\",-infinity,\"{\"\"a\"\": \"\"\uFFFD\"\"}\","
            "00112233-4455-6677-8899-aabbccddeeff,\"{1,-1}\",)");
}

TEST_F(DatabaseTest, CopyOfManyMegabytesSucceedsOrFailsAsAWhole) {
  Must("CREATE TEMPORARY TABLE wide(i int4 CHECK (i < 20000), s bytea)");
  const std::vector<std::uint8_t> bytes(1000);
  CopyRows good(2);
  CopyRows bad(2);
  bad.Row().Int4(20000).Null();
  for (int i = 0; i < 20'000; ++i) {
    good.Row().Int4(i).Binary(bytes);
    bad.Row().Int4(i).Binary(bytes);
  }
  const auto copied = database_.Copy("wide(i, s)", good);
  ASSERT_TRUE(copied) << ErrorText(copied);
  EXPECT_EQ(*copied, 20'000);
  const auto failed = database_.Copy("wide(i, s)", bad);  // in its first row, while the others are on their way
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().fault, DatabaseFault::kConstraint);
  EXPECT_EQ(failed.error().sqlstate, "23514");
  EXPECT_EQ(Number(database_, "SELECT count(*) FROM wide"), 20'000);
  const auto other = database_.Copy("nothing(i)", good);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().fault, DatabaseFault::kNoSchema);
  EXPECT_TRUE(database_.connected());
}

TEST_F(DatabaseTest, ForEachNeedsNoMemoryForTheAnswer) {
  std::int64_t sum = 0;
  const auto done =
      database_.ForEach("SELECT generate_series(1, $1::int8)", {Parameter::Int(10'000)}, [&](const Rows& row) {
        sum += row.Int(0, 0).value_or(0);
        return row.size() == 1;
      });
  EXPECT_TRUE(done) << ErrorText(done);
  EXPECT_EQ(sum, 50'005'000);
  EXPECT_FALSE(database_.ForEach("SELECT generate_series(1, 1000000000)", {}, [](const Rows&) { return false; }));
  EXPECT_FALSE(database_.connected());
}

TEST_F(DatabaseTest, CommitReportsWhatHappened) {
  Must("CREATE TEMPORARY TABLE kept(i int4 UNIQUE DEFERRABLE INITIALLY DEFERRED)");
  ASSERT_TRUE(database_.Begin());
  EXPECT_EQ(database_.Execute("INSERT INTO kept VALUES (1), (2)").value_or(0), 2);
  EXPECT_EQ(database_.CommitTransaction().state, CommitState::kCommitted);

  ASSERT_TRUE(database_.Begin());
  EXPECT_FALSE(database_.Execute("SELECT 1 / 0"));
  EXPECT_EQ(database_.CommitTransaction().state, CommitState::kRolledBack);

  ASSERT_TRUE(database_.Begin());
  EXPECT_TRUE(database_.Execute("INSERT INTO kept VALUES (1)"));
  const Commit commit = database_.CommitTransaction();  // checks the deferred constraint
  EXPECT_EQ(commit.state, CommitState::kRolledBack);
  EXPECT_EQ(commit.error.fault, DatabaseFault::kConstraint);

  ASSERT_TRUE(database_.Begin());
  EXPECT_TRUE(database_.Execute("DELETE FROM kept"));
  database_.Rollback();
  EXPECT_EQ(Number(database_, "SELECT count(*) FROM kept"), 2);
}

// A commit that waits for a standby that does not exist. Every outcome is unknown: the row is in this server, and in no other.
class UnacknowledgedCommit : public DatabaseTest {
 protected:
  UnacknowledgedCommit() : waiting_({.connection = TestConnection(), .commit_limit = 60 * kSecond}, secrets_) {
    Must("CREATE TABLE IF NOT EXISTS public.unacknowledged(i int4)");
    Must("ALTER SYSTEM SET synchronous_standby_names = 'nobody'");
    Must("SET synchronous_commit = local; SELECT pg_reload_conf()");
    EXPECT_TRUE(waiting_.Connect());
  }
  ~UnacknowledgedCommit() override {
    Must("ALTER SYSTEM RESET synchronous_standby_names");
    Must("SELECT pg_reload_conf()");
  }
  // Begins a transaction once the session sees the new setting.
  void Insert(Database& database) {
    while (Number(database, "SELECT (current_setting('synchronous_standby_names') = 'nobody')::int") != 1) {
    }
    ASSERT_TRUE(database.Begin());
    ASSERT_TRUE(database.Execute("INSERT INTO public.unacknowledged VALUES (1)"));
  }
  // Does something to the backend of `waiting_` as soon as it waits for its standby.
  void ToWaiting(const std::string& function) {
    while (Number(database_,
                  "SELECT count(" + function + "(pid)) FROM pg_stat_activity WHERE wait_event = 'SyncRep'") == 0) {
    }
  }

  Database waiting_;
};

TEST_F(UnacknowledgedCommit, TimeLimitLeavesTheOutcomeUnknown) {
  Database hasty({.connection = TestConnection(), .commit_limit = 200 * kMillisecond}, secrets_);
  ASSERT_TRUE(hasty.Connect());
  Insert(hasty);
  const Commit commit = hasty.CommitTransaction();
  EXPECT_EQ(commit.state, CommitState::kUnknown);
  EXPECT_EQ(commit.error.fault, DatabaseFault::kTimeLimit);
  EXPECT_FALSE(hasty.connected());
}

TEST_F(UnacknowledgedCommit, CancelledWaitIsNoAcknowledgement) {
  Insert(waiting_);
  std::thread cancel([this] { ToWaiting("pg_cancel_backend"); });
  const Commit commit = waiting_.CommitTransaction();
  cancel.join();
  EXPECT_EQ(commit.state, CommitState::kUnknown);
  EXPECT_EQ(commit.error.sqlstate, "01000");
  EXPECT_FALSE(waiting_.connected());
}

TEST_F(UnacknowledgedCommit, TerminatedBackendLeavesTheOutcomeUnknown) {
  Insert(waiting_);
  std::thread terminate([this] { ToWaiting("pg_terminate_backend"); });
  const Commit commit = waiting_.CommitTransaction();
  terminate.join();
  EXPECT_EQ(commit.state, CommitState::kUnknown);
  EXPECT_EQ(commit.error.fault, DatabaseFault::kConnectionLost) << commit.error.text;
  EXPECT_FALSE(waiting_.connected());
}

TEST_F(DatabaseTest, StatementThatTakesTooLongEndsTheConnection) {
  Database hasty({.connection = TestConnection(), .statement_limit = 500 * kMillisecond}, secrets_);
  ASSERT_TRUE(hasty.Connect());
  const auto slept = hasty.Execute("SELECT pg_sleep(600)");
  ASSERT_FALSE(slept);
  EXPECT_EQ(slept.error().fault, DatabaseFault::kTimeLimit);
  EXPECT_NE(slept.error().text.find("within 0.5 s"), std::string::npos) << slept.error().text;
  EXPECT_FALSE(hasty.connected());
  EXPECT_EQ(hasty.Execute("SELECT 1").error().fault, DatabaseFault::kConnectionLost);
}

TEST_F(DatabaseTest, StopEndsAWait) {
  const WakeEvent stop;
  Database stoppable({.connection = TestConnection(), .stop = stop.FileDescriptor()}, secrets_);
  ASSERT_TRUE(stoppable.Connect());
  std::thread later([&] {
    while (Number(database_, "SELECT count(*) FROM pg_stat_activity WHERE wait_event = 'PgSleep'") == 0) {
    }
    stop.Set();
  });
  const auto slept = stoppable.Execute("SELECT pg_sleep(600)");
  later.join();
  ASSERT_FALSE(slept);
  EXPECT_EQ(slept.error().fault, DatabaseFault::kStopped);
  EXPECT_EQ(stoppable.Connect().error().fault, DatabaseFault::kStopped);
}

TEST_F(DatabaseTest, TerminatedBackendIsALostConnection) {
  const auto ended = database_.Execute("SELECT pg_terminate_backend(pg_backend_pid())");
  ASSERT_FALSE(ended);
  EXPECT_EQ(ended.error().fault, DatabaseFault::kConnectionLost);
  EXPECT_FALSE(database_.connected());
  EXPECT_TRUE(database_.Connect());
}

TEST_F(DatabaseTest, ErrorsNameWhatToDo) {
  Database elsewhere({.connection = "host=/nowhere dbname=x"}, secrets_);
  const auto none = elsewhere.Connect();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().fault, DatabaseFault::kConnectionLost);
  EXPECT_NE(none.error().text.find("Check that the server runs"), std::string::npos) << none.error().text;

  Database nameless({.connection = TestConnection() + " dbname=nothing"}, secrets_);
  const auto missing = nameless.Connect();
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().fault, DatabaseFault::kNoDatabase) << missing.error().text;
  EXPECT_EQ(missing.error().sqlstate, "3D000");
  EXPECT_EQ(missing.error().text.find("LOCATION"), std::string::npos) << missing.error().text;

  Database unknown({.connection = TestConnection() + " user=stranger"}, secrets_);
  EXPECT_EQ(unknown.Connect().error().fault, DatabaseFault::kCredentials);

  Database secretive({.connection = TestConnection(), .password = {"/missing", {}, false}}, secrets_);
  EXPECT_EQ(secretive.Connect().error().fault, DatabaseFault::kCredentials);
}

TEST_F(DatabaseTest, WriterPassesAServerThatIsReadOnly) {
  Must("ALTER SYSTEM SET default_transaction_read_only = on");
  Must("SELECT pg_reload_conf()");
  Database writer({.connection = TestConnection()}, secrets_);
  Database reader({.connection = TestConnection(), .writes = false}, secrets_);
  auto refused = writer.Connect();
  while (refused) refused = writer.Connect();  // until the setting holds
  EXPECT_EQ(refused.error().fault, DatabaseFault::kReadOnly) << refused.error().text;
  EXPECT_TRUE(reader.Connect());
  Must("SET default_transaction_read_only = off");
  Must("ALTER SYSTEM RESET default_transaction_read_only");
  Must("SELECT pg_reload_conf()");
}

// A host that accepts the connection and is silent then, as one that was suspended.
TEST_F(DatabaseTest, SilentHostCostsItsLimitOnly) {
  const TemporaryFolder folder;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string path = folder.path() + "/.s.PGSQL.5432";
  ASSERT_LT(path.size(), sizeof address.sun_path);
  path.copy(static_cast<char*>(address.sun_path), path.size());
  const Descriptor silent(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  ASSERT_EQ(bind(silent.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);  // NOLINT
  ASSERT_EQ(listen(silent.get(), 1), 0);
  std::string connection = TestConnection();
  connection.insert(connection.find("host=") + 5, folder.path() + ",");
  Database database({.connection = connection, .connect_limit = 2 * kSecond}, secrets_);
  const auto connected = database.Connect();
  EXPECT_TRUE(connected) << ErrorText(connected);
  EXPECT_NE(database.host(), folder.path());
}

TEST_F(DatabaseTest, NoticesAreKept) {
  Must("DO $$ BEGIN RAISE WARNING 'attention'; END $$");
  EXPECT_EQ(database_.TakeNotices(), std::vector<std::string>{"WARNING: attention"});
  EXPECT_TRUE(database_.TakeNotices().empty());
}

}  // namespace
}  // namespace axlecast::db
