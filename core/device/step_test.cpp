#include "core/device/step.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace axlecast {
namespace {

using ByteList = std::vector<std::uint8_t>;

Event Answered(Bytes request, Bytes reply) {
  return {.kind = Event::Kind::kReply,
          .sent = {1000, 1500},
          .received = {20'000, 21'000},
          .request = request,
          .bytes = reply};
}

TEST(Event, EndsWithTheLaterOfItsIntervals) {
  EXPECT_EQ(Answered({}, {}).End(), 21'000);
  EXPECT_EQ((Event{.kind = Event::Kind::kTimeout, .sent = {1000, 1500}}.End()), 1'500);
}

TEST(SamplingInstant, LeavesOutTheWiresTime) {
  const ByteList request(8);
  const ByteList reply(7);
  const Event event = Answered(request, reply);
  EXPECT_EQ(event.ActedWithin(reply.size(), 100), (Interval{1'800, 19'900}));
  EXPECT_EQ(event.ActedWithin(reply.size(), 1'000), (Interval{9'000, 14'000}));
}

TEST(SamplingInstant, IsNeverTurnedAround) {
  const ByteList request(8);
  const ByteList reply(7);
  EXPECT_EQ(Answered(request, reply).ActedWithin(reply.size(), 10'000), (Interval{81'000, 81'000}));
  const ByteList id3(1);
  const ByteList all(11);
  EXPECT_EQ(Answered(id3, all).ActedWithin(all.size(), 4'000), (Interval{5'000, 5'000}));
}

}  // namespace
}  // namespace axlecast
