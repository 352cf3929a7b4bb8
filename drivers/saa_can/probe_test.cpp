#include "drivers/saa_can/family.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/runtime/bus/transactor.h"
#include "tests/support/probe_run.h"
#include "tests/support/scripted_frame_link.h"

namespace axlecast::saa_can {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

// A CAN bus in virtual time on which these frames come, each at its period.
class DeviceFixture {
 public:
  DeviceFixture() { EXPECT_TRUE(link_.Open()); }

  void Send(std::uint32_t id, const ByteList& data, MonoNs period) {
    for (MonoNs at = period; at < 3 * kSecond; at += period) {
      link_.ArriveAt(clock_.Now() + at, {.id = id, .data = InlineBytes<kMaxCanData>(data)});
    }
  }
  std::vector<ProbeHit> Run() {
    CanTransactor medium(link_, clock_);
    const std::unique_ptr<Probe> probe = saa_can_probe({}).at(0).make(clock_.Now());
    StaleReplyGuard guard(kLatestProbeReply);
    EXPECT_TRUE(RunProbe(*probe, medium, clock_, guard, [] { return false; }));
    EXPECT_THAT(link_.sent(), IsEmpty());
    return probe->Findings();
  }

 private:
  FakeClock clock_;
  ScriptedFrameLink link_{clock_};
};

TEST(SaaCanProbe, FindsTheEncoderOfTheManualsLog) {
  DeviceFixture bench;  // SAA manual 5.4.1 (1): 120# 47 26, each 106.4 ms
  bench.Send(0x120, {0x47, 0x26, 0, 0, 0, 0, 0, 0}, 106'400 * kMicrosecond);
  const std::vector<ProbeHit> found = bench.Run();
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kLikely) << found[0].reason;
  EXPECT_EQ(ValueOf(found[0].keys, "node"), "0x20");
  EXPECT_EQ(ValueOf(found[0].keys, "period_ms"), "106");
  EXPECT_EQ(ValueOf(found[0].keys, "bits"), "16");
  EXPECT_THAT(found[0].check, HasSubstr("14 to 16"));  // 9799 takes 14
}

TEST(SaaCanProbe, TakesAHeartbeatAndItsProcessDataForACanopenNode) {
  DeviceFixture bench;
  bench.Send(0x185, {0x10, 0x27, 0x00, 0x00}, 50 * kMillisecond);
  bench.Send(0x705, {0x05}, 500 * kMillisecond);
  const std::vector<ProbeHit> found = bench.Run();
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].device, "CANopen node 5");
  EXPECT_THAT(found[0].keys, IsEmpty());
}

TEST(SaaCanProbe, WithoutAHeartbeatTheSharedIdentifiersAreOnlyPossible) {
  DeviceFixture bench;
  bench.Send(0x185, {0x10, 0x27}, 50 * kMillisecond);
  const std::vector<ProbeHit> found = bench.Run();
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].confidence, Confidence::kPossible);
  EXPECT_EQ(ValueOf(found[0].keys, "node"), "0x85");
}

TEST(SaaCanProbe, TakesNoOtherTrafficForAnEncoder) {
  DeviceFixture bench;
  bench.Send(0x130, {1, 2, 3, 4, 5, 6, 7, 8}, 20 * kMillisecond);              // too long for a position
  bench.Send(0x131, {1}, 20 * kMillisecond);                                   // or so short
  bench.Send(0x080, {}, 20 * kMillisecond);                                    // SYNC
  bench.Send(0x120 | kCanExtended, {0x47, 0x26}, 20 * kMillisecond);           // 29 bits
  bench.Send(0x120 | kCanRemote, {}, 20 * kMillisecond);                       // a request
  bench.Send(0x004 | kCanError, {0, 0, 0, 0, 0, 0, 0, 0}, 20 * kMillisecond);  // of the controller
  EXPECT_THAT(bench.Run(), IsEmpty());
}

TEST(SaaCanProbe, ASilentBusHoldsNothing) { EXPECT_THAT(DeviceFixture().Run(), IsEmpty()); }

}  // namespace
}  // namespace axlecast::saa_can
