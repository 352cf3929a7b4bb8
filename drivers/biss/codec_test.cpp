#include "drivers/biss/codec.h"

#include <gtest/gtest.h>

#include "core/device/operation.h"
#include "drivers/biss/bits_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::biss {
namespace {

Reply Frame(const std::string& text, const Format& format) {
  return FrameReader(format).ReadFrame(BytesOf(text), 0, CountOf(text));
}
Reply Transfer(const std::string& text, const Format& format, const Search& search = {}) {
  return FrameReader(format).ReadTransfer(BytesOf(text), CountOf(text), search);
}
FrameError ErrorOf(const std::string& text, const Search& search = {}) {
  return Transfer(text, {.bits = 16}, search).error;
}

std::string StatusOf(const Reply& reply) {
  if (reply.failed) return "error";
  return reply.warned ? "warning" : "good";
}

const std::string kExample = "1000101011100011 10 001010";

TEST(BissCodec, EveryRow) {
  for (const GoldenRow& row : GoldenRows(__FILE__, "frames.txt", 4)) {
    const Format format{.bits = std::stoi(row.columns[0])};
    const Reply reply = Frame(row.columns[1], format);
    EXPECT_EQ(reply.error, FrameError::kNone) << row.where;
    EXPECT_EQ(std::to_string(reply.counts), row.columns[2]) << row.where;
    EXPECT_EQ(StatusOf(reply), row.columns[3]) << row.where;
    const Reply whole = Transfer("110010" + row.columns[1] + "000", format);
    EXPECT_EQ(whole.error, FrameError::kNone) << row.where;
    EXPECT_EQ(whole.counts, reply.counts) << row.where;
  }
}

// 5.6: theta = 360 a / 2^n: 195.3094.
TEST(BissCodec, TheManualsAngle) {
  EXPECT_NEAR(Degrees(Frame(kExample, {.bits = 16}).counts, 16), 195.3094, 0.00005);
}

TEST(BissCodec, EveryResolution) {
  for (int bits = kMinBits; bits <= kMaxBits; ++bits) {
    const std::uint64_t maximum = (std::uint64_t{1} << static_cast<unsigned>(bits)) - 1;
    for (const std::uint64_t counts : {std::uint64_t{0}, std::uint64_t{1}, maximum / 3, maximum}) {
      const Reply reply = Frame(FrameText(counts, bits), {.bits = bits});
      EXPECT_EQ(reply.error, FrameError::kNone) << bits;
      EXPECT_EQ(reply.counts, counts);
      EXPECT_EQ(StatusOf(reply), "good");
    }
  }
}

TEST(BissCodec, TurnsStandBeforeThePosition) {
  const Format format{.bits = 12, .turn_bits = 8};
  const Reply reply = Frame(FrameText(0xA5'123, 20), format);
  EXPECT_EQ(reply.error, FrameError::kNone);
  EXPECT_EQ(reply.turns, 0xA5U);
  EXPECT_EQ(reply.counts, 0x123U);
  const Reply longest = Frame(FrameText(0xF'FFFF'8000'0001, 52), {.bits = 32, .turn_bits = 20});
  EXPECT_EQ(longest.turns, 0xF'FFFFU);
  EXPECT_EQ(longest.counts, 0x8000'0001U);
}

// x^8 + x^4 + x^3 + x^2 + 1 from 0xFF, as it is.
TEST(BissCodec, AnotherCheck) {
  const Format format{.bits = 16, .crc = {.bits = 8, .polynomial = 0x11D, .start = 0xFF, .inverted = false}};
  const std::string covered = "1000101011100011 11";
  const std::string text = covered + NaiveCrc(covered, 0x11D, 8, 0xFF, false);
  EXPECT_EQ(Frame(text, format).error, FrameError::kNone);
  EXPECT_EQ(Frame(kExample + "00", format).error, FrameError::kChecksum);
}

// 5.6: acknowledgement (0), start bit (1), a fixed 0, then the position.
TEST(BissCodec, FindsTheFrameAtAnyDelayAndAnyBusyTime) {
  for (std::size_t delay = 0; delay < 40; ++delay) {
    for (std::size_t busy = 1; busy < 40; ++busy) {
      const Reply reply =
          Transfer(std::string(2 + delay, '1') + std::string(busy, '0') + "10" + kExample + "0000", {.bits = 16});
      ASSERT_EQ(reply.error, FrameError::kNone) << delay << ' ' << busy;
      EXPECT_EQ(reply.counts, 35555U);
      EXPECT_EQ(reply.ack, 2 + delay);
      EXPECT_EQ(reply.start, 2 + delay + busy);
    }
  }
}

TEST(BissCodec, NamesWhatIsMissing) {
  EXPECT_EQ(ErrorOf("11 00 10" + kExample), FrameError::kNone);
  EXPECT_EQ(ErrorOf("01 00 10" + kExample), FrameError::kLow) << "low before any edge";
  EXPECT_EQ(ErrorOf("10 00 10" + kExample), FrameError::kLow) << "low after the first rising edge";
  EXPECT_EQ(ErrorOf(std::string(64, '0')), FrameError::kLow) << "a shorted line";
  EXPECT_EQ(ErrorOf(std::string(64, '1')), FrameError::kNoAck);
  EXPECT_EQ(ErrorOf("11" + std::string(62, '0')), FrameError::kNoStart);
  EXPECT_EQ(ErrorOf("11 00 11" + kExample), FrameError::kCds);
  EXPECT_EQ(ErrorOf("11 00 10" + kExample.substr(0, kExample.size() - 1)), FrameError::kShort);
  EXPECT_EQ(ErrorOf("11 00 1"), FrameError::kShort);
  EXPECT_EQ(ErrorOf("11 00 10 1000101011100011 11 001010"), FrameError::kChecksum);
  EXPECT_EQ(ErrorOf("11 00 10 1000101011100011 10 110101"), FrameError::kChecksum) << "not inverted";
  EXPECT_EQ(ErrorOf("1"), FrameError::kShort);
  EXPECT_EQ(ErrorOf(""), FrameError::kShort);
}

TEST(BissCodec, LooksNoFurtherThanItIsTold) {
  const std::string late_ack = "1111 00 10" + kExample;
  EXPECT_EQ(ErrorOf(late_ack, {.latest_ack = 4, .latest_start = 6}), FrameError::kNone);
  EXPECT_EQ(ErrorOf(late_ack, {.latest_ack = 3, .latest_start = 6}), FrameError::kNoAck);
  EXPECT_EQ(ErrorOf(late_ack, {.latest_ack = 4, .latest_start = 5}), FrameError::kNoStart);
}

// A line that is stuck, or a frame that stops, is none: the check bits are inverted for that.
TEST(BissCodec, AStuckLineIsNoFrame) {
  EXPECT_EQ(Frame(std::string(24, '0'), {.bits = 16}).error, FrameError::kChecksum);
  EXPECT_EQ(Frame(std::string(24, '1'), {.bits = 16}).error, FrameError::kChecksum);
}

TEST(BissCodec, NoOneOrTwoWrongBitsOfAFramePass) {
  const std::string good =
      "1000101011100011"
      "10"
      "001010";
  for (std::size_t a = 0; a < good.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      std::string bad = good;
      bad[a] = bad[a] == '0' ? '1' : '0';
      if (b < a) bad[b] = bad[b] == '0' ? '1' : '0';
      EXPECT_EQ(Frame(bad, {.bits = 16}).error, FrameError::kChecksum) << a << ' ' << b;
    }
  }
}

}  // namespace
}  // namespace axlecast::biss
