#include <axlecast/device_info_t.hpp>

#include "drivers/runtime/axis/channel_fixture.h"

namespace axlecast {
namespace {

using ChannelSummaryTest = ChannelTest;

TEST_F(ChannelSummaryTest, IdentityIsWhatAPersonWouldTellTheEncoderBy) {
  Make();
  EXPECT_EQ(channel_->summary().identity, "");
  channel_->OnIdentity(17, "", "1.2");
  EXPECT_EQ(channel_->summary().identity, "17");
  channel_->OnIdentity(17, "SN0042", "1.2");
  EXPECT_EQ(channel_->summary().identity, "17 SN0042");
  channel_->OnIdentity(-1, "SN0042", "1.2");
  EXPECT_EQ(channel_->summary().identity, "SN0042");
  channel_->OnIdentity(-1, "", "1.2");
  EXPECT_EQ(channel_->summary().identity, "");
}

TEST_F(ChannelSummaryTest, PositionIsTheLastValidReadingBeforeTheDatum) {
  device_.config.direction = -1;
  Make();
  EXPECT_FALSE(channel_->summary().position);
  Read(1'000);
  EXPECT_FALSE(channel_->summary().position);  // waits for a second that agrees
  Read(1'000);
  const MonoNs last = t_ - kMillisecond;
  ASSERT_TRUE(channel_->summary().position);
  const std::int64_t counts = channel_->summary().position->counts;
  EXPECT_EQ(counts, Positions().back().counts);
  EXPECT_EQ(channel_->summary().position->utime, kUtcAtZero + last / kMicrosecond);
  EXPECT_FALSE(channel_->summary().datum);

  channel_->SetDatum(-300, UtcNow());
  EXPECT_EQ(channel_->summary().datum, (Reference::Datum{-300, UtcNow()}));
  EXPECT_EQ(channel_->summary().position->counts, counts);
  Sample bad = ReadingAt(t_, 5'000);
  bad.error = true;
  Read(bad);
  Fail(3);
  EXPECT_EQ(channel_->summary().position->counts, counts);
  EXPECT_EQ(channel_->summary().position->utime, kUtcAtZero + last / kMicrosecond);

  channel_->OnJump();
  EXPECT_FALSE(channel_->summary().position);
  EXPECT_FALSE(channel_->summary().datum);
}

TEST_F(ChannelSummaryTest, AClearedDatumIsANewEpochOnce) {
  Make();
  Read(1'000, 2);
  const std::int32_t epoch = channel_->summary().datum_epoch;
  channel_->ClearDatum();
  EXPECT_EQ(channel_->summary().datum_epoch, epoch);
  channel_->SetDatum(5, UtcNow());
  channel_->ClearDatum();
  EXPECT_EQ(channel_->summary().datum_epoch, epoch + 2);
  EXPECT_FALSE(channel_->summary().datum);
  EXPECT_EQ(*channel_->ValueWith(0), channel_->summary().value);
}

}  // namespace
}  // namespace axlecast
