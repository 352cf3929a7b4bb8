#include "core/time/chrony_packet.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace axlecast {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes FromHex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i < text.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

// Replies of chronyd 4.3 (Debian 12, 4.3-2+deb12u3, run with -x) to requests with the sequence 0x01020304, received on
// 127.0.0.1:323. The first is of a client of 10.0.0.1, which serves `local stratum 1`. `chronyc -n tracking`, run directly after it,
// printed: Reference ID 0A000001 (10.0.0.1), Stratum 2, Ref time 10:59:41 2026-11-26, System time 0.000002167 seconds fast, Residual freq
// +0.003 ppm, Skew 0.102 ppm, Root delay 0.000008787 seconds, Root dispersion 0.000001166 seconds, Leap status Normal.
const Bytes kReply = FromHex(
    "060200000021000500000000000000000102030400000000000000000a0000010a000001000000000000000000000000"
    "0001000000020000000000006b08111d3928828fdf6e7b56db27269bda829fc5f946b139f2b0e91cfcd158cbe2936be1dc96678d0087c9"
    "77");
// The same before it had a server. chronyc printed: Reference ID 00000000 (), Stratum 0, Leap status Not synchronised.
const Bytes kNoServer = FromHex(
    "060200000021000500000000000000000102030400000000000000000000000000000000000000000000000000000000"
    "00000000000000030000000000000000000000000000000000000000000000000000000000000000000000000480000004800000"
    "00000000");
constexpr std::uint32_t kSequence = 0x01020304;

TEST(ChronyPacket, AReplyOfChronydIsDecoded) {
  ASSERT_EQ(kReply.size(), kChronyPacketBytes);
  const auto tracking = DecodedTracking(kReply, kSequence);
  ASSERT_TRUE(tracking);
  EXPECT_EQ(tracking->reference_id, 0x0A000001U);
  EXPECT_EQ(tracking->reference, "10.0.0.1");
  EXPECT_EQ(tracking->stratum, 2);
  EXPECT_EQ(tracking->leap, 0);
  EXPECT_EQ(tracking->reference_utc_ns / 1'000'000'000, 1'795'690'781) << "2026-11-26 10:59:41";
  EXPECT_NEAR(tracking->correction_s, -2.167e-6, 0.1e-6);
  EXPECT_NEAR(tracking->residual_frequency_ppm, 0.003, 0.0006);
  EXPECT_NEAR(tracking->skew_ppm, 0.102, 0.0006);
  EXPECT_NEAR(tracking->root_delay_s, 8.787e-6, 0.6e-9);
  EXPECT_NEAR(tracking->root_dispersion_s, 1.166e-6, 0.1e-6);
  EXPECT_TRUE(tracking->FollowsReference());
}

TEST(ChronyPacket, WithoutAServerItFollowsNoReference) {
  const auto tracking = DecodedTracking(kNoServer, kSequence);
  ASSERT_TRUE(tracking);
  EXPECT_EQ(tracking->leap, ChronyTracking::kNotSynchronised);
  EXPECT_DOUBLE_EQ(tracking->root_delay_s, 1.0);
  EXPECT_DOUBLE_EQ(tracking->root_dispersion_s, 1.0);
  EXPECT_FALSE(tracking->FollowsReference());
}

TEST(ChronyPacket, ItsOwnClockIsNoReference) {
  Bytes local = kReply;
  const Bytes id = {0x7f, 0x7f, 0x01, 0x01};
  std::copy(id.begin(), id.end(), local.begin() + 28);
  EXPECT_FALSE(DecodedTracking(local, kSequence)->FollowsReference());
}

TEST(ChronyPacket, AReferenceClockHasItsName) {
  Bytes gps = kReply;
  const Bytes id = {'G', 'P', 'S', 0};
  std::copy(id.begin(), id.end(), gps.begin() + 28);
  gps[49] = 0;  // no address
  EXPECT_EQ(DecodedTracking(gps, kSequence)->reference, "GPS");
  gps[49] = 2;
  EXPECT_EQ(DecodedTracking(gps, kSequence)->reference, "a00:1::");
}

TEST(ChronyPacket, OtherDatagramsAreRefused) {
  EXPECT_FALSE(DecodedTracking(kReply, kSequence + 1));
  for (std::size_t size = 0; size < kReply.size(); ++size) {
    EXPECT_FALSE(DecodedTracking(std::span(kReply).first(size), kSequence)) << size;
  }
  Bytes longer = kReply;
  longer.push_back(0);
  EXPECT_FALSE(DecodedTracking(longer, kSequence));
  for (const std::size_t at : std::vector<std::size_t>{0, 1, 4, 5, 6, 7, 8, 9, 16, 19}) {
    Bytes changed = kReply;
    changed[at] ^= 0x40U;
    EXPECT_FALSE(DecodedTracking(changed, kSequence)) << at;
  }
  Bytes negative = kReply;
  negative[96] = 0x01;  // the dispersion, with the sign of its coefficient set
  EXPECT_FALSE(DecodedTracking(negative, kSequence));
}

// Its bytes are those to which chronyd answered.
TEST(ChronyPacket, ARequestIsAsLongAsItsReply) {
  Bytes expected(kChronyPacketBytes);
  const Bytes head = {6, 1, 0, 0, 0, 33, 0, 0, 1, 2, 3, 4};
  std::copy(head.begin(), head.end(), expected.begin());
  const ChronyRequest request = TrackingRequest(kSequence);
  EXPECT_EQ(Bytes(request.begin(), request.end()), expected);
}

}  // namespace
}  // namespace axlecast
