#include "drivers/saa_serial/stream_parser.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/support/golden_file.h"

namespace axlecast::saa_serial {
namespace {

constexpr MonoNs kCharacter = 100 * kMicrosecond;
const Format kFormat{.bits = 14, .header = ReplyHeader::kEither, .address = 0xB1};

struct Exchanged {
  std::vector<std::uint8_t> request = {0xBC, 0xAA, 0xB1};
  std::vector<std::uint8_t> bytes;
  Event event;
};

// The write took 10 us from 1 s on; the reply's reads returned at `first` and `last`.
Exchanged Replied(const std::string& hex, MonoNs first, MonoNs last, Event::Kind kind = Event::Kind::kReply) {
  Exchanged exchanged;
  exchanged.bytes = GoldenBytes(hex);
  exchanged.event.kind = kind;
  exchanged.event.sent = {kSecond, kSecond + 10 * kMicrosecond};
  exchanged.event.received = {kSecond + first, kSecond + last};
  exchanged.event.request = exchanged.request;
  exchanged.event.bytes = exchanged.bytes;
  return exchanged;
}

TEST(SaaReading, LiesBetweenTheRequestAndTheFirstBitOfTheReply) {
  const Exchanged whole = Replied("FF 81 01 7F 00", 2 * kMillisecond, 2 * kMillisecond);
  const PolledReading read = ReadReply(whole.event, kFormat, kCharacter);
  ASSERT_FALSE(read.reading.error);
  EXPECT_EQ(read.reading.counts, 383U);
  // Three characters of request after the write began; five of reply before the read.
  EXPECT_EQ(read.reading.at, (Interval{kSecond + 300 * kMicrosecond, kSecond + 1500 * kMicrosecond}));
  // The first byte alone came earlier.
  const Exchanged parts = Replied("FF 81 01 7F 00", 900 * kMicrosecond, 2 * kMillisecond);
  EXPECT_EQ(ReadReply(parts.event, kFormat, kCharacter).reading.at.last, kSecond + 800 * kMicrosecond);
}

TEST(SaaReading, OnASimulatedLineTheWiresTimeIsLeftOut) {
  const Exchanged whole = Replied("FF 81 01 7F 00", 20 * kMicrosecond, 20 * kMicrosecond);
  EXPECT_EQ(ReadReply(whole.event, kFormat, 0).reading.at, (Interval{kSecond, kSecond + 20 * kMicrosecond}));
}

TEST(SaaReading, BytesBeforeTheFrameAreStray) {
  for (const char* hex : {"00 FF 81 01 7F 00", "FF FF 81 01 7F 00", "81 7F FF 81 01 7F 00"}) {
    const Exchanged exchanged = Replied(hex, kMillisecond, kMillisecond);
    const PolledReading read = ReadReply(exchanged.event, kFormat, kCharacter);
    EXPECT_FALSE(read.reading.error) << hex;
    EXPECT_EQ(read.reading.counts, 383U) << hex;
    EXPECT_EQ(read.stray, exchanged.bytes.size() - 5) << hex;
  }
}

TEST(SaaReading, EachDamageHasItsKind) {
  const std::vector<std::pair<std::string, ErrorKind>> rows = {
      {"", ErrorKind::kTimeout},
      {"FF 81 01 7F", ErrorKind::kShort},
      {"01 7F", ErrorKind::kShort},
      {"11 22 33 44 55", ErrorKind::kChecksum},
      {"FF 81 01 7F 01", ErrorKind::kChecksum},
      {"FF B2 01 7F 31", ErrorKind::kWrongEcho},  // another encoder's address
      {"FF 81 40 00 C0", ErrorKind::kRange},
  };
  for (const auto& [hex, kind] : rows) {
    const Exchanged exchanged = Replied(hex, kMillisecond, kMillisecond, Event::Kind::kTimeout);
    const PolledReading read = ReadReply(exchanged.event, kFormat, kCharacter);
    EXPECT_EQ(read.reading.error, kind) << hex;
    EXPECT_EQ(read.reading.at, (Interval{kSecond, kSecond + kMillisecond})) << hex << ": when its bytes came";
  }
}

TEST(SaaReading, TheReplysLengthCountsFromItsFirstByte) {
  for (const auto& [bits, size] : {std::pair{10, 5U}, {16, 5U}, {17, 6U}, {24, 6U}, {25, 7U}, {26, 7U}}) {
    const ReplyLength length = LengthRule(bits);
    EXPECT_EQ(length(GoldenBytes("")), 0U);
    EXPECT_EQ(length(GoldenBytes("FF")), 0U);
    EXPECT_EQ(length(GoldenBytes("FF 81")), size);
    EXPECT_EQ(length(GoldenBytes("FF B7 00 00")), size);
    EXPECT_EQ(length(GoldenBytes("00 00 FF 81")), size + 2);
    EXPECT_EQ(length(GoldenBytes("FF FF 81")), size + 1);
    EXPECT_EQ(length(GoldenBytes("00 01 02 03 04 05 06 07")), 0U);
  }
}

constexpr StreamTimes kTimes{.character = kCharacter,
                             .slowest = kCharacter,
                             .period = 10 * kMillisecond,
                             .processing = 3 * kMillisecond,
                             .latency = kMillisecond};

// "The arrival of the frame's first byte less the wire time, with an honest uncertainty".
TEST(SaaReading, AStreamedFrameIsAsOldAsItsFirstByteLessItsTimeOnTheWire) {
  StreamParser::Found found;
  found.first = {kSecond, kSecond + 50 * kMicrosecond};
  found.last = {kSecond + 450 * kMicrosecond, kSecond + 500 * kMicrosecond};
  found.behind = 0;
  const Interval at = StreamedInstant(found, 5, kTimes);
  EXPECT_EQ(at.last, kSecond - 50 * kMicrosecond) << "a character before the first read returned";
  EXPECT_EQ(at.first, kSecond - (3'000 + 1'000 + 100) * kMicrosecond) << "T3, adapter and one character earlier";
}

// A host that was asleep finds several frames at once: the last of them is young, the first is not.
TEST(SaaReading, FramesReadTogetherAreAsOldAsWhatCameBehindThem) {
  StreamParser::Found found;
  found.first = found.last = {kSecond, kSecond + 50 * kMillisecond};
  found.behind = 0;
  const Interval newest = StreamedInstant(found, 5, kTimes);
  found.behind = 15;
  const Interval oldest = StreamedInstant(found, 5, kTimes);
  EXPECT_EQ(newest.last - oldest.last, 15 * kCharacter);
  EXPECT_EQ(newest.first - oldest.first, 3 * kTimes.period) << "three more periods may have gone by";
  found.behind.reset();
  EXPECT_EQ(StreamedInstant(found, 5, kTimes).first, kSecond - 4'100 * kMicrosecond) << "nothing is known of it";
}

// README.md, "Instant of a position": the second frame of a stall is one period, less 1 %, younger than the one before it.
TEST(SaaReading, FramesOfAStallBeginOnePeriodAfterTheOneBefore) {
  StreamTimes times = kTimes;
  times.late = 100 * kMillisecond;
  const auto usual = [&](MonoNs arrived) {
    return Interval{arrived - times.period - times.latency - times.processing, arrived};
  };
  StalledFrames frames(times);
  frames.Restart(kSecond);
  const auto widened = [&](MonoNs arrived) {
    frames.Arrived(arrived);
    return frames.Widened(usual(arrived)).first;
  };
  MonoNs now = kSecond;
  for (int i = 0; i < 3; ++i) {
    now += times.period + times.latency;
    EXPECT_EQ(widened(now), usual(now).first) << "in time";
  }
  const MonoNs before = usual(now).first;
  now += 45 * kMillisecond;
  constexpr MonoNs kShortest = 9'900 * kMicrosecond;
  EXPECT_EQ(widened(now), before + kShortest);
  EXPECT_EQ(widened(now + kMillisecond), before + 2 * kShortest);
  EXPECT_EQ(widened(now + 2 * kMillisecond), before + 3 * kShortest);
  EXPECT_EQ(widened(now + 3 * kMillisecond), before + 4 * kShortest);
  EXPECT_EQ(widened(now + 4 * kMillisecond), usual(now + 4 * kMillisecond).first) << "none is missing any more";

  // Of a pause longer than late_us no frame can be older than that; and with the last pause it ends.
  now += kSecond;
  EXPECT_EQ(widened(now), usual(now).first - (times.late - times.latency));
  for (const MonoNs end = now + times.late; now + times.period < end;) {
    now += times.period;
    EXPECT_LT(widened(now), usual(now).first);
  }
  now += times.period;
  EXPECT_EQ(widened(now), usual(now).first);
}

// Frames that come in a stall of 45 ms, in which four were held back.
class StallTest : public ::testing::Test {
 protected:
  static constexpr MonoNs kShortest = 9'900 * kMicrosecond;  // a period, less 1 %

  StallTest() {
    times_.late = 100 * kMillisecond;
    frames_.emplace(times_);
    frames_->Restart(now_);
    EXPECT_EQ(LateBy(times_.period + times_.latency), 0) << "in time";
  }
  // Receives a frame after `pause`. Returns how much earlier its interval begins than that of a frame in time.
  MonoNs LateBy(MonoNs pause) {
    now_ += pause;
    frames_->Arrived(now_);
    const MonoNs usual = now_ - times_.period - times_.latency - times_.processing;
    return usual - frames_->Widened({usual, now_}).first;
  }
  // The late ones, of which the last comes `last` after the first.
  MonoNs Stall(MonoNs last) {
    LateBy(45 * kMillisecond);
    LateBy(kMillisecond);
    LateBy(kMillisecond);
    LateBy(kMillisecond);
    return LateBy(last - 3 * kMillisecond);
  }

  StreamTimes times_ = kTimes;
  std::optional<StalledFrames> frames_;
  MonoNs now_ = kSecond;
};

TEST_F(StallTest, NothingIsWidenedOnceAllHaveCome) {
  EXPECT_EQ(Stall(4 * kMillisecond), 0);
  EXPECT_EQ(LateBy(times_.period), 0);
}

TEST_F(StallTest, ThosePresentMayBeAsLateAsTheLastOfTheStallUntilThePause) {
  EXPECT_EQ(Stall(5 * kMillisecond), 500 * kMicrosecond);
  EXPECT_EQ(LateBy(times_.period), 500 * kMicrosecond);
  EXPECT_EQ(LateBy(times_.period + 1'200 * kMicrosecond), 500 * kMicrosecond) << "no pause: an eighth of a period";
  EXPECT_EQ(LateBy(times_.period + 1'300 * kMicrosecond), 500 * kMicrosecond + 11'300 * kMicrosecond - kShortest);
}

TEST_F(StallTest, ThoseOfOneWholePeriodStayAsLate) {
  LateBy(45 * kMillisecond);
  LateBy(kMillisecond);
  LateBy(kMillisecond);
  EXPECT_EQ(LateBy(2'600 * kMicrosecond), times_.period);
  EXPECT_EQ(LateBy(times_.period), times_.period);
}

TEST_F(StallTest, AFrameThatComesAsEarlyAsItCanEndsTheStall) {
  EXPECT_EQ(Stall(4'500 * kMicrosecond), 0);
  EXPECT_EQ(LateBy(times_.period + 1'200 * kMicrosecond), 11'200 * kMicrosecond - kShortest) << "another stall";
}

TEST_F(StallTest, AfterARestartNothingOldIsLate) {
  EXPECT_EQ(Stall(5 * kMillisecond), 500 * kMicrosecond);
  frames_->Restart(now_);
  EXPECT_EQ(LateBy(times_.period), 0);
  EXPECT_EQ(LateBy(times_.period), 0);
  EXPECT_EQ(LateBy(times_.period + 1'200 * kMicrosecond), 11'200 * kMicrosecond - kShortest)
      << "a stall of its own";
}

}  // namespace
}  // namespace axlecast::saa_serial
