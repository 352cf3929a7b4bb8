// A shipper with a real server: tests/fleet/cluster.py starts this program.
#include "tools/fleet/ship/shipper.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <string>
#include <thread>

#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/temporary_folder.h"
#include "tools/fleet/schema/migration.h"

namespace axlecast {
namespace {

// An hour lasts a few seconds.
class FastClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override { return start_ + 500 * (real_.Now() - start_); }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return real_.UtcMicroseconds(); }

 private:
  SystemClock real_;
  MonoNs start_ = real_.Now();
};

class ShipperWithServer : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_FALSE(connection_.empty()) << "run it by tests/fleet/cluster.py";
    ASSERT_TRUE(admin_.Connect());
    ASSERT_TRUE(admin_.Script("DROP SCHEMA IF EXISTS axlecast CASCADE"));
    const auto migrated = MigrateSchema(admin_, {.writer = "ship", .reader = ""});
    ASSERT_TRUE(migrated) << migrated.error().text;
    AddOld();
  }
  void TearDown() override { EndShipper(); }

  static std::string Connection() {
    const char* const connection = std::getenv("AXLECAST_TEST_DATABASE");
    return connection == nullptr ? "" : connection;
  }
  // Adds a message that is older than the retention of the table odd.
  void AddOld() {
    const auto added = admin_.Script(
        "INSERT INTO axlecast.odd (machine, log, event, channel, utime, received, cause, message, noticed) SELECT "
        "1, 1, "
        "coalesce(max(event), 0) + 1, 'X', 0, 0, '', '', now() - interval '2 years' FROM axlecast.odd");
    ASSERT_TRUE(added) << added.error().text;
  }
  [[nodiscard]] std::int64_t OldRows() {
    const auto rows = admin_.Query("SELECT count(*) FROM axlecast.odd");
    return rows ? rows->Int(0, 0).value_or(-1) : -1;
  }
  static bool Eventually(const std::function<bool()>& holds) {
    const SystemClock clock;
    const MonoNs end = clock.Now() + 60 * kSecond;
    while (!holds()) {
      if (clock.Now() > end) return false;
      static_cast<void>(PollUntil({}, clock.Now() + 20 * kMillisecond, clock));
    }
    return true;
  }
  void StartShipper() {
    thread_ = std::thread([this] { static_cast<void>(shipper_.Run()); });
  }
  void EndShipper() {
    stop_.Set();
    if (thread_.joinable()) thread_.join();
  }

  std::string connection_ = Connection();
  FixedSecrets secrets_;
  FastClock clock_;
  WakeEvent stop_;
  TemporaryFolder folder_;
  db::Database admin_{{.connection = connection_}, secrets_};
  ShipDatabase database_{{.connection = connection_ + " user=ship",
                          .password = {},
                          .machine = "press3",
                          .installation = "11111111-2222-3333-4444-555555555555",
                          .shipper = "test",
                          .stop = stop_.FileDescriptor()},
                         secrets_,
                         clock_};
  Shipper shipper_{{.folder = folder_.path(), .names = {"press3"}, .detail = {}, .stop = stop_.FileDescriptor()},
                   database_,
                   clock_};
  std::thread thread_;
};

TEST_F(ShipperWithServer, DeletesWhatIsOlderThanItsRetentionAgainAndAgain) {
  StartShipper();
  EXPECT_TRUE(Eventually([this] { return OldRows() == 0; })) << shipper_.Status().problems.Text();
  AddOld();
  // The database's clock is not the fast one: for the database, the last deletion was just now.
  ASSERT_TRUE(admin_.Script("UPDATE axlecast.expiry SET finished = finished - interval '1 h'"));
  EXPECT_TRUE(Eventually([this] { return OldRows() == 0; })) << shipper_.Status().problems.Text();
  EXPECT_EQ(shipper_.Status().problems.Text(), "");
}

TEST_F(ShipperWithServer, GoesOnAfterAnErrorOfTheRetention) {
  ASSERT_TRUE(admin_.Script("REVOKE EXECUTE ON FUNCTION axlecast.expire(interval) FROM axlecast_writer"));
  StartShipper();
  EXPECT_TRUE(Eventually(
      [this] { return shipper_.Status().problems.retention.find("permission denied") != std::string::npos; }));
  EXPECT_TRUE(shipper_.Status().connected);
  EXPECT_EQ(OldRows(), 1);
  ASSERT_TRUE(admin_.Script("GRANT EXECUTE ON FUNCTION axlecast.expire(interval) TO axlecast_writer"));
  EXPECT_TRUE(Eventually([this] { return OldRows() == 0; }));
  EXPECT_TRUE(Eventually([this] { return shipper_.Status().problems.Text().empty(); }));
}

TEST_F(ShipperWithServer, OneOfManyDeletes) {
  ASSERT_TRUE(admin_.Script("SELECT axlecast.expire()"));
  AddOld();
  ASSERT_TRUE(database_.Connect());
  EXPECT_TRUE(database_.Expire());
  EXPECT_EQ(OldRows(), 1);
  ASSERT_TRUE(admin_.Script("UPDATE axlecast.expiry SET finished = finished - interval '1 h'"));
  EXPECT_TRUE(database_.Expire());
  EXPECT_EQ(OldRows(), 0);
}

}  // namespace
}  // namespace axlecast
