#include "tools/fleet/ship/log_shipment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/fleet/ship/shipment_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using LogShipmentTest = ShipmentFixture;

TEST_F(LogShipmentTest, FollowsALogThatGrows) {
  AppendStretch(10);
  const auto shipment = Open();
  ShipBatch batch = shipment->Next(kThisYear, {}).batch;
  EXPECT_EQ(batch.rows.samples, 10);
  EXPECT_EQ(batch.before.upto, 0);
  EXPECT_EQ(batch.after.upto, 12);  // the head, the positions and the seal
  EXPECT_EQ(batch.after.bytes, log_.bytes);
  EXPECT_FALSE(batch.after.closed);
  EXPECT_NE(batch.after.chain, 0U);
  batch = shipment->Next(kThisYear, {}).batch;
  EXPECT_EQ(batch.after, batch.before) << "nothing more is sealed";
  AppendStretch(5);
  Write();
  ASSERT_TRUE(shipment->Refresh(log_));
  batch = shipment->Next(kThisYear, {}).batch;
  EXPECT_EQ(batch.before.upto, 12);
  EXPECT_EQ(batch.rows.samples, 5);
  log_.closed = true;
  ASSERT_TRUE(shipment->Refresh(log_));
  batch = shipment->Next(kThisYear, {}).batch;
  EXPECT_TRUE(batch.after.closed);
  EXPECT_EQ(batch.after.upto, batch.before.upto);
}

TEST_F(LogShipmentTest, AFailedBatchIsComposedAgainFromTheLedger) {
  AppendStretch(10);
  AppendStretch(20);
  auto shipment = Open();
  const ComposedBatch first = shipment->Next(kThisYear, {.one_stretch = true});
  EXPECT_TRUE(first.more);
  EXPECT_EQ(first.batch.rows.samples, 10);
  shipment = Open(first.batch.after);
  const ShipBatch second = shipment->Next(kThisYear, {}).batch;
  EXPECT_EQ(second.rows.samples, 20);
  EXPECT_EQ(second.rows.chunks.at(0).seq0, 10);
  const ShipBatch all = Open()->Next(kThisYear, {}).batch;
  EXPECT_EQ(all.after, second.after) << "position and chain do not depend on the batches";
}

TEST_F(LogShipmentTest, BoundsABatch) {
  for (int i = 0; i < 20; ++i) AppendStretch(50);
  const auto shipment = Open();
  std::int64_t samples = 0;
  int batches = 0;
  for (bool more = true; more; ++batches) {
    const ComposedBatch next = shipment->Next(kThisYear, {.bytes = 30'000});
    EXPECT_LT(next.batch.after.bytes - next.batch.before.bytes, 30'000 + 10'000);
    samples += next.batch.rows.samples;
    more = next.more;
  }
  EXPECT_EQ(samples, 1'000);
  EXPECT_GT(batches, 4);
}

TEST_F(LogShipmentTest, DamageIsAHoleBetweenTheMessagesAroundIt) {
  AppendStretch(10);
  AppendStretch(10);
  AppendStretch(10);
  bytes_[offsets_[15] + 60] ^= 1U;
  const ShipBatch batch = Open()->Next(kThisYear, {}).batch;
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
  const ShipBatch batch = Open()->Next(kThisYear, {}).batch;
  ASSERT_THAT(batch.holes, SizeIs(1));
  EXPECT_THAT(batch.holes[0].cause, HasSubstr("torn"));
  EXPECT_EQ(batch.holes[0].messages, -1);
  EXPECT_TRUE(batch.after.closed);
}

TEST_F(LogShipmentTest, RowsThatTheDatabaseRefusesBecomeAHole) {
  AppendStretch(10);
  AppendStretch(20);
  const auto shipment = Open();
  const ShipBatch batch = shipment->NextAsHole("refused").batch;
  EXPECT_EQ(batch.rows.samples, 0);
  ASSERT_THAT(batch.holes, SizeIs(1));
  EXPECT_EQ(batch.holes[0].messages, 11);  // with the head
  EXPECT_EQ(shipment->Next(kThisYear, {}).batch.rows.samples, 20);
}

TEST_F(LogShipmentTest, BehindTheLastHoleTheLogIsComplete) {
  AppendStretch(10);
  const auto shipment = Open();
  EXPECT_FALSE(shipment->NextAsHole("refused").batch.after.closed);
  ComposedBatch end = shipment->NextAsHole("refused");
  EXPECT_EQ(end.batch.after, end.batch.before) << "nothing more is sealed";
  log_.closed = true;
  ASSERT_TRUE(shipment->Refresh(log_));
  end = shipment->NextAsHole("refused");
  EXPECT_TRUE(end.batch.after.closed);
  EXPECT_FALSE(end.more);
  EXPECT_THAT(end.batch.holes, IsEmpty());
}

TEST_F(LogShipmentTest, ReportsAFileThatCannotBeRead) {
  log_.file = "none.lcm";
  EXPECT_THAT(LogShipment::Open(folder_.path(), log_, {}, {}, kThisYear, std::nullopt).error().text,
              HasSubstr("none.lcm"));
}

}  // namespace
}  // namespace axlecast
