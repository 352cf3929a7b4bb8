#include "tools/fleet/ship/log_shipment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tools/fleet/row_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class LogShipmentTest : public ::testing::Test {
 protected:
  LogShipmentTest() {
    log_.file = "a.lcm";
    log_.key = {"all", "plc1", kT0, 0};
    log_.facts = std::make_shared<const LogFacts>(PressFacts());
    Append({.utime = kT0, .channel = kRecorderChannel, .data = {}});
  }

  void Append(const LogEvent& event) {
    const Bytes record = encoder_.Add(event);
    offsets_.push_back(bytes_.size());
    bytes_.insert(bytes_.end(), record.begin(), record.end());
  }
  // Appends `count` positions, 4 ms apart, and their seal.
  void AppendStretch(int count) {
    for (int i = 0; i < count; ++i) {
      position_t position{};
      position.utime = kT0 + 4'000 * seq_;
      position.boot_id = kBoot;
      position.seq = seq_++;
      position.counts = 100 + position.seq;
      position.counts_per_turn = 131'072;
      position.unit = position_t::UNIT_MM;
      position.flags = position_t::FLAG_VALID;
      const std::vector<std::uint8_t> message = Encoded(position);
      Append({.utime = position.utime + 500, .channel = "POSITION/axis1", .data = message});
    }
    const Bytes seal = encoder_.Seal(kT0 + 4'000 * seq_);
    bytes_.insert(bytes_.end(), seal.begin(), seal.end());
  }
  void Write() {
    std::ofstream(folder_.path() + "/a.lcm", std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    log_.bytes = static_cast<std::int64_t>(bytes_.size());
  }
  std::unique_ptr<LogShipment> Open(const LedgerEntry& entry = {.id = 7}) {
    Write();
    return LogShipment::Open(folder_.path(), log_, entry, {}, kThisYear, std::nullopt).value();
  }

  TemporaryFolder folder_;
  FolderLog log_;
  LogEncoder encoder_;
  std::vector<std::uint8_t> bytes_;
  std::vector<std::size_t> offsets_;
  std::int64_t seq_ = 0;
};

TEST_F(LogShipmentTest, FollowsALogThatGrows) {
  AppendStretch(10);
  const auto shipment = Open();
  ShipBatch batch = shipment->Next(kThisYear, {});
  EXPECT_EQ(batch.rows.samples, 10);
  EXPECT_EQ(batch.before.upto, 0);
  EXPECT_EQ(batch.after.upto, 12);  // the head, the positions and the seal
  EXPECT_EQ(batch.after.bytes, log_.bytes);
  EXPECT_FALSE(batch.after.closed);
  EXPECT_NE(batch.after.chain, 0U);
  shipment->Committed(batch);
  batch = shipment->Next(kThisYear, {});
  EXPECT_EQ(batch.after, batch.before) << "nothing more is sealed";
  AppendStretch(5);
  Write();
  ASSERT_TRUE(shipment->Refresh(log_));
  batch = shipment->Next(kThisYear, {});
  EXPECT_EQ(batch.before.upto, 12);
  EXPECT_EQ(batch.rows.samples, 5);
  shipment->Committed(batch);
  log_.closed = true;
  ASSERT_TRUE(shipment->Refresh(log_));
  batch = shipment->Next(kThisYear, {});
  EXPECT_TRUE(batch.after.closed);
  EXPECT_EQ(batch.after.upto, batch.before.upto);
}

TEST_F(LogShipmentTest, AFailedBatchIsComposedAgainFromTheLedger) {
  AppendStretch(10);
  AppendStretch(20);
  auto shipment = Open();
  ShipBatch first = shipment->Next(kThisYear, {.one_stretch = true});
  EXPECT_TRUE(shipment->more());
  EXPECT_EQ(first.rows.samples, 10);
  shipment = Open(first.after);
  const ShipBatch second = shipment->Next(kThisYear, {});
  EXPECT_EQ(second.rows.samples, 20);
  EXPECT_EQ(second.rows.chunks.at(0).seq0, 10);
  const ShipBatch all = Open()->Next(kThisYear, {});
  EXPECT_EQ(all.after, second.after) << "position and chain do not depend on the batches";
}

TEST_F(LogShipmentTest, BoundsABatch) {
  for (int i = 0; i < 20; ++i) AppendStretch(50);
  const auto shipment = Open();
  std::int64_t samples = 0;
  int batches = 0;
  for (bool more = true; more; ++batches) {
    const ShipBatch batch = shipment->Next(kThisYear, {.bytes = 30'000});
    EXPECT_LT(batch.after.bytes - batch.before.bytes, 30'000 + 10'000);
    samples += batch.rows.samples;
    shipment->Committed(batch);
    more = shipment->more();
  }
  EXPECT_EQ(samples, 1'000);
  EXPECT_GT(batches, 4);
}

TEST_F(LogShipmentTest, DamageIsAHoleBetweenTheMessagesAroundIt) {
  AppendStretch(10);
  AppendStretch(10);
  AppendStretch(10);
  bytes_[offsets_[15] + 60] ^= 1U;
  const ShipBatch batch = Open()->Next(kThisYear, {});
  EXPECT_EQ(batch.rows.samples, 20);
  ASSERT_THAT(batch.holes, SizeIs(1));
  EXPECT_EQ(batch.holes[0].cause, "the log is damaged");
  EXPECT_EQ(batch.holes[0].first_event, 12);
  EXPECT_EQ(batch.holes[0].messages, 10);
  EXPECT_EQ(batch.holes[0].t0, kT0 + 4'000 * 9 + 500);
  EXPECT_EQ(batch.holes[0].t1, kT0 + 4'000 * 20 + 500);
}

TEST_F(LogShipmentTest, TheTornEndOfAClosedLogIsAHole) {
  AppendStretch(10);
  bytes_.insert(bytes_.end(), 30, 0xED);
  log_.closed = true;
  const ShipBatch batch = Open()->Next(kThisYear, {});
  ASSERT_THAT(batch.holes, SizeIs(1));
  EXPECT_THAT(batch.holes[0].cause, HasSubstr("torn"));
  EXPECT_EQ(batch.holes[0].messages, -1);
  EXPECT_TRUE(batch.after.closed);
}

TEST_F(LogShipmentTest, RowsThatTheDatabaseRefusesBecomeAHole) {
  AppendStretch(10);
  AppendStretch(20);
  const auto shipment = Open();
  const ShipBatch batch = shipment->NextAsHole("refused");
  EXPECT_EQ(batch.rows.samples, 0);
  ASSERT_THAT(batch.holes, SizeIs(1));
  EXPECT_EQ(batch.holes[0].messages, 11);  // with the head
  shipment->Committed(batch);
  EXPECT_EQ(shipment->Next(kThisYear, {}).rows.samples, 20);
}

TEST_F(LogShipmentTest, ReportsAFileThatCannotBeRead) {
  log_.file = "none.lcm";
  EXPECT_THAT(LogShipment::Open(folder_.path(), log_, {}, {}, kThisYear, std::nullopt).error().text,
              HasSubstr("none.lcm"));
}

}  // namespace
}  // namespace axlecast
