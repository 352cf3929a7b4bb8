#include "tools/fleet/ship/batch_pipeline.h"

#include <gtest/gtest.h>

#include "tools/fleet/ship/shipment_fixture.h"

namespace axlecast {
namespace {

class BatchPipelineTest : public ShipmentFixture {
 protected:
  static constexpr BatchLimit kStretch{.one_stretch = true};
};

TEST_F(BatchPipelineTest, PreparedBatchesAreThoseThatAreComposedOneByOne) {
  for (int i = 0; i < 20; ++i) AppendStretch(50);
  const auto shipment = Open();
  BatchPipeline pipeline(Open());
  std::int64_t samples = 0;
  for (bool more = true; more;) {
    const ComposedBatch expected = shipment->Next(kThisYear, {.bytes = 30'000});
    const ComposedBatch next = pipeline.Next(kThisYear, {.bytes = 30'000});
    if (next.more) pipeline.Prepare(kThisYear, {.bytes = 30'000});
    EXPECT_EQ(next.batch.before, expected.batch.before);
    EXPECT_EQ(next.batch.after, expected.batch.after);
    EXPECT_EQ(next.batch.rows.samples, expected.batch.rows.samples);
    EXPECT_EQ(next.last_received, expected.last_received);
    EXPECT_EQ(next.more, expected.more);
    samples += next.batch.rows.samples;
    more = next.more;
  }
  EXPECT_EQ(samples, 1'000);
}

TEST_F(BatchPipelineTest, APreparedBatchHasTheLogAsItWasThen) {
  AppendStretch(10);
  AppendStretch(10);
  BatchPipeline pipeline(Open());
  EXPECT_EQ(pipeline.Next(kThisYear, kStretch).batch.rows.samples, 10);
  pipeline.Prepare(kThisYear, {});
  AppendStretch(5);
  Write();
  log_.closed = true;
  ASSERT_TRUE(pipeline.Refresh(log_));
  const ShipBatch prepared = pipeline.Next(kThisYear, {}).batch;
  EXPECT_EQ(prepared.rows.samples, 10);
  EXPECT_FALSE(prepared.after.closed);
  ASSERT_TRUE(pipeline.Refresh(log_));
  const ShipBatch last = pipeline.Next(kThisYear, {}).batch;
  EXPECT_EQ(last.before, prepared.after);
  EXPECT_EQ(last.rows.samples, 5);
  EXPECT_TRUE(last.after.closed);
}

TEST_F(BatchPipelineTest, EndsWithABatchThatNobodyTakes) {
  for (int i = 0; i < 20; ++i) AppendStretch(50);
  BatchPipeline pipeline(Open());
  pipeline.Prepare(kThisYear, {});
}

}  // namespace
}  // namespace axlecast
