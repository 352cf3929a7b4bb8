#include "tools/mqtt/sparkplug/sparkplug_topics.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

using Received = SparkplugTopics::Received;

TEST(SparkplugTopics, TopicsOfANodeAndItsDevices) {
  const SparkplugTopics topics("plant", "press3", "scada1");
  EXPECT_EQ(topics.OfNode("NBIRTH"), "spBv1.0/plant/NBIRTH/press3");
  EXPECT_EQ(topics.OfDevice("DDATA", "axis1"), "spBv1.0/plant/DDATA/press3/axis1");
  EXPECT_EQ(topics.node_command(), "spBv1.0/plant/NCMD/press3");
  EXPECT_EQ(topics.host_state(), "spBv1.0/STATE/scada1");
}

TEST(SparkplugTopics, OnlyTheNodesOwnCommandAndItsHostAreKnown) {
  const SparkplugTopics topics("plant", "press3", "scada1");
  EXPECT_EQ(topics.KindOf("spBv1.0/plant/NCMD/press3"), Received::kNodeCommand);
  EXPECT_EQ(topics.KindOf("spBv1.0/STATE/scada1"), Received::kHostState);
  for (const char* other :
       {"spBv1.0/STATE/scada2", "spBv1.0/plant/STATE/scada1", "STATE/scada1", "spBv1.0/plant/NCMD/press4",
        "spBv1.0/plant/DCMD/press3/axis1", "", "spBv1.0/plant/NCMD/press3/"}) {
    EXPECT_EQ(topics.KindOf(other), Received::kOther) << other;
  }
  // A group named STATE leads to no confusion.
  EXPECT_EQ(SparkplugTopics("STATE", "n", "NCMD").KindOf("spBv1.0/STATE/NCMD/n"), Received::kNodeCommand);
}

TEST(SparkplugTopics, WithoutAHostThereIsNoState) {
  EXPECT_EQ(SparkplugTopics("plant", "press3", "").host_state(), "");
  EXPECT_EQ(SparkplugTopics("plant", "press3", "").KindOf(""), Received::kOther);
}

}  // namespace
}  // namespace axlecast
