#include "drivers/saa_serial/stream_parser.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/saa_serial/stream_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_serial {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::int64_t> Places(const ByteList& stream, int bits = 16) {
  StreamParser parser(bits);
  return FramePlaces(ParseAll(parser, stream, stream.size()));
}

ByteList Hex(const std::string& text) { return GoldenBytes(text); }

// The promises of the class, judged by the naive list of all places where a frame is possible. Room is left behind
// the last candidate for the parser to see what overlaps it.
void CheckPromises(ByteList stream, int bits, std::size_t chunk) {
  const auto size = static_cast<std::int64_t>(ReplySize(bits));
  stream.resize(stream.size() + 3 * static_cast<std::size_t>(size), 0);
  const std::set<std::int64_t> all = NaiveFrames(stream, bits);
  StreamParser parser(bits);
  const std::vector<std::int64_t> found = FramePlaces(ParseAll(parser, stream, chunk));
  std::int64_t end = 0;
  for (const std::int64_t place : found) {
    ASSERT_TRUE(all.contains(place)) << "what was found is no frame";
    const bool shared = place == end - 1 && stream[static_cast<std::size_t>(place)] == 0xFF;
    ASSERT_TRUE(place >= end || shared) << "two that were found overlap";
    end = place + size;
    ASSERT_TRUE(!all.contains(end) || std::binary_search(found.begin(), found.end(), end))
        << "the frame that begins where a found one ended was lost";
  }
  for (auto it = all.begin(); it != all.end(); ++it) {
    const bool before = it != all.begin() && *std::prev(it) + size > *it;
    const bool behind = std::next(it) != all.end() && *it + size > *std::next(it);
    if (before || behind) continue;
    ASSERT_TRUE(std::binary_search(found.begin(), found.end(), *it)) << "lost, though nothing overlaps it: " << *it;
  }
}

// Calls `check` with every stream that `alphabet` makes of the bytes of `stream` from `first` on.
template <typename Check>
void ForEvery(Bytes alphabet, ByteList stream, std::size_t first, Check check) {
  std::size_t streams = 1;
  for (std::size_t at = first; at < stream.size(); ++at) streams *= alphabet.size();
  for (std::size_t number = 0; number < streams; ++number) {
    std::size_t rest = number;
    for (std::size_t at = first; at < stream.size(); ++at) {
      stream[at] = alphabet[rest % alphabet.size()];
      rest /= alphabet.size();
    }
    check(stream);
    if (::testing::Test::HasFatalFailure()) FAIL() << "stream " << number << " from byte " << first << " on";
  }
}

// Every stream of `length` bytes of the alphabet, but one for all that differ only before their first FF 81. The parser
// drops these bytes one by one, whatever they are: EveryVeryShortStream has all of them.
template <typename Check>
void ForEveryFromItsFirstFront(Bytes alphabet, std::size_t length, Check check) {
  for (std::size_t front = 0; front + 2 <= length; ++front) {
    ByteList stream(length, alphabet.back());
    stream[front] = 0xFF;
    stream[front + 1] = 0x81;
    ForEvery(alphabet, stream, front + 2, check);
    if (::testing::Test::HasFatalFailure()) FAIL() << "FF 81 at " << front;
  }
}

// Five bytes that make frames and look-alikes.
constexpr std::array<std::uint8_t, 5> kFiveBytes = {0xFF, 0x81, 0x00, 0x01, 0x02};

// 78,125 streams, with every beginning.
TEST(SaaStreamParser, KeepsItsPromisesOnEveryVeryShortStream) {
  constexpr std::size_t kLength = 7;
  ForEvery(kFiveBytes, ByteList(kLength), 0,
           [](const ByteList& stream) { CheckPromises(stream, 16, kLength + 1); });
}

// Every stream of nine bytes: 1,953,125, of which 97,656 differ from their first FF 81 on.
TEST(SaaStreamParser, KeepsItsPromisesOnEveryShortStream) {
  constexpr std::size_t kLength = 9;
  ForEveryFromItsFirstFront(kFiveBytes, kLength,
                            [](const ByteList& stream) { CheckPromises(stream, 16, kLength + 1); });
}

// Every stream of twelve of the three bytes that look-alikes of three and four data bytes are made of.
TEST(SaaStreamParser, KeepsItsPromisesOnEveryLookAlike) {
  constexpr std::array<std::uint8_t, 3> kAlphabet = {0xFF, 0x81, 0x01};
  for (const int bits : {16, 24}) {
    ForEveryFromItsFirstFront(kAlphabet, 12, [bits](const ByteList& stream) { CheckPromises(stream, bits, 5); });
  }
}

TEST(SaaStreamParser, KeepsItsPromisesOnNoisyStreams) {
  SeededRandom random(1);
  for (const int bits : {10, 14, 16, 17, 24, 25, 26}) {
    for (int round = 0; round < 300; ++round) {
      ByteList stream;
      while (stream.size() < 400) {
        Append(stream, StreamFrame(static_cast<std::uint32_t>(random.Next() % (1U << bits)), bits));
        const std::uint64_t what = random.Next() % 12;
        if (what == 0) stream.pop_back();
        if (what == 1) stream.push_back(0xFF);
        if (what == 2) stream.back() = static_cast<std::uint8_t>(stream.back() ^ 1U << random.Next() % 8);
        if (what == 3) Append(stream, Hex("FF 81 FF 81"));
      }
      CheckPromises(stream, bits, 1 + random.Next() % 40);
      if (HasFatalFailure()) FAIL() << "bits " << bits << ", round " << round;
    }
  }
}

TEST(SaaStreamParser, HowTheBytesWereReadChangesNothing) {
  SeededRandom random(2);
  ByteList stream;
  for (int i = 0; i < 200; ++i) {
    Append(stream, StreamFrame(static_cast<std::uint32_t>(random.Next() % 65'536), 16));
    if (random.Next() % 4 == 0) stream.erase(stream.end() - 1 - static_cast<std::ptrdiff_t>(random.Next() % 8));
  }
  StreamParser whole(16);
  const auto expected = FramePlaces(ParseAll(whole, stream, 200));
  for (const std::size_t chunk : {1U, 2U, 3U, 5U, 7U, 13U, 64U}) {
    StreamParser parser(16);
    EXPECT_EQ(FramePlaces(ParseAll(parser, stream, chunk)), expected) << chunk;
    EXPECT_EQ(parser.skipped(), whole.skipped()) << chunk;
  }
}

TEST(SaaStreamParser, AFrameIsFoundWithItsLastByte) {
  StreamParser parser(14);
  const auto found = ParseAll(parser, Hex("FF 81 01 7F 00"), 1);
  ASSERT_THAT(FramePlaces(found), ElementsAre(0));
  EXPECT_EQ(found[0].counts, 383U);
}

// FF81H holds the front of another frame; the front of the next one shows that it is not a frame.
TEST(SaaStreamParser, WhereAnotherFrameCouldBeginInsideItWaitsForTheNext) {
  StreamParser parser(16);
  EXPECT_THAT(FramePlaces(ParseAll(parser, StreamFrame(0xFF81, 16), 1)), IsEmpty());
  EXPECT_THAT(FramePlaces(ParseAll(parser, {0xFF, 0x81}, 1)), ElementsAre(0));
}

TEST(SaaStreamParser, ABadByteCostsOnlyItsOwnFrame) {
  const ByteList good = Hex("FF 81 01 7F 00");
  for (std::size_t at = 0; at < 5; ++at) {
    ByteList stream;
    for (int i = 0; i < 3; ++i) Append(stream, good);
    ByteList bad = good;
    bad[at] ^= 0x10;
    Append(stream, bad);
    Append(stream, good);  // and the next is found with its last byte
    StreamParser parser(14);
    const auto found = ParseAll(parser, stream, stream.size());
    EXPECT_THAT(FramePlaces(found), ElementsAre(0, 5, 10, 20)) << at;
    EXPECT_EQ(std::count_if(found.begin(), found.end(), [](const auto& each) { return each.error.has_value(); }),
              1);
    EXPECT_EQ(parser.skipped(), 5);
  }
}

TEST(SaaStreamParser, ALostOrExtraByteCostsOnlyItsOwnFrame) {
  const ByteList good = Hex("FF 81 01 7F 00");
  for (const bool extra : {false, true}) {
    for (std::size_t at = 0; at < 5; ++at) {
      ByteList stream = good;
      ByteList bad = good;
      const auto where = bad.begin() + static_cast<std::ptrdiff_t>(at);
      if (extra) {
        bad.insert(where, 0x55);
      } else {
        bad.erase(where);
      }
      Append(stream, bad);
      const auto next = static_cast<std::int64_t>(stream.size());
      for (int i = 0; i < 3; ++i) Append(stream, good);
      std::vector<std::int64_t> places = Places(stream, 14);
      // A byte more at the very begin or end leaves the frame whole.
      if (extra && at == 0) places.erase(std::remove(places.begin(), places.end(), 6), places.end());
      EXPECT_THAT(places, ElementsAre(0, next, next + 5, next + 10)) << extra << ' ' << at;
    }
  }
}

// 16 bits: 02FF followed by 00xx holds a whole look-alike, FF 81 FF 81 00 from its fourth byte on.
TEST(SaaStreamParser, ALookAlikeNeverWinsInStep) {
  ByteList stream = StreamFrame(0x1234, 16);
  Append(stream, StreamFrame(0x02FF, 16));
  Append(stream, StreamFrame(0x0012, 16));
  ASSERT_TRUE(NaiveFrames(stream, 16).contains(8));
  EXPECT_THAT(Places(stream), ElementsAre(0, 5, 10));
}

// The same out of step: the frame that another follows is right.
TEST(SaaStreamParser, OutOfStepTheFrameThatIsFollowedWins) {
  ByteList stream = {0x00, 0x11};
  Append(stream, StreamFrame(0x02FF, 16));
  Append(stream, StreamFrame(0x0012, 16));
  Append(stream, StreamFrame(0x0013, 16));
  ASSERT_TRUE(NaiveFrames(stream, 16).contains(5));
  EXPECT_THAT(Places(stream), ElementsAre(2, 7, 12));
}

// Bad bytes that make a look-alike with the front of a good frame: FF 81 02 | FF 81 .. ..
TEST(SaaStreamParser, BadBytesDoNotSwallowTheGoodFrameBehindThem) {
  ByteList stream = Hex("FF 81 02");
  Append(stream, StreamFrame(0x1234, 16));
  ASSERT_TRUE(NaiveFrames(stream, 16).contains(0));
  Append(stream, Hex("00 00 00 00 00 00 00 00"));
  EXPECT_THAT(Places(stream), ElementsAre(3)) << "not even when nothing good follows it";
}

// The positions that a parser finds in a stream of constant `counts` if the first byte is within a frame.
std::set<std::uint32_t> FoundAtRest(std::uint32_t counts, int bits) {
  ByteList stream = {0x00};
  for (int i = 0; i < 5; ++i) Append(stream, StreamFrame(counts, bits));
  StreamParser parser(bits);
  std::set<std::uint32_t> found;
  for (const auto& each : ParseAll(parser, stream, stream.size())) {
    if (!each.error) found.insert(each.counts);
  }
  return found;
}

// README.md, "Positions that can be read in two ways". With two data bytes none.
TEST(SaaStreamParser, APositionAtRestIsAmbiguousOnlyWhereTheReadmeSays) {
  for (unsigned counts = 0; counts < 65'536; ++counts) ASSERT_THAT(FoundAtRest(counts, 16), ElementsAre(counts));
  for (const std::uint32_t counts : {0xFF8101U, 0x0101FFU, 0xFF8181U, 0x8181FFU}) {
    EXPECT_THAT(FoundAtRest(counts, 24), IsEmpty()) << counts;
  }
  for (std::uint32_t top = 0; top < 4; ++top) {
    EXPECT_THAT(FoundAtRest(top << 24 | 0x00FF8100, 26), IsEmpty()) << top;
  }
  // Where three data bytes hold no FF, no second frame can begin in them or in the checksum before 81H: all that hold
  // FF 81 in two ways.
  for (std::uint32_t other = 0; other < 256; ++other) {
    const bool listed = other == 0x01 || other == 0x81;
    EXPECT_EQ(FoundAtRest(0xFF8100 + other, 24).empty(), listed) << other;
  }
}

// 24 bits at rest on FF8101: both phases repeat for ever.
TEST(SaaStreamParser, WhatCanBeReadInTwoWaysIsNotReadUntilItMoves) {
  ByteList stream = Hex("00");
  for (int i = 0; i < 50; ++i) Append(stream, StreamFrame(0xFF8101, 24));
  StreamParser parser(24);
  EXPECT_THAT(FramePlaces(ParseAll(parser, stream, 6)), IsEmpty());
  EXPECT_GT(parser.ambiguous(), 50);
  ByteList moved;
  for (std::uint32_t i = 0; i < 5; ++i) Append(moved, StreamFrame(0xFF8102 + i, 24));
  const auto found = ParseAll(parser, moved, 6);
  std::vector<std::uint32_t> counts;
  for (const auto& each : found) {
    if (!each.error) counts.push_back(each.counts);
  }
  ASSERT_GE(counts.size(), 4U);
  EXPECT_EQ(counts.back(), 0xFF8105U);
  EXPECT_TRUE(std::all_of(counts.begin(), counts.end(), [](std::uint32_t c) { return c >= 0xFF8101; }));
}

TEST(SaaStreamParser, InStepTheSamePositionIsReadAllTheTime) {
  ByteList stream;
  for (std::uint32_t i = 0; i < 3; ++i) Append(stream, StreamFrame(0xFF80FF + i, 24));
  for (int i = 0; i < 20; ++i) Append(stream, StreamFrame(0xFF8101, 24));
  EXPECT_EQ(Places(stream, 24).size(), 22U) << "the last waits for the next";
}

// ---- of candidates that overlap, which one is taken: the rules of the class ----

// Bytes with a candidate at their begin and another three bytes later, of which none is followed.
constexpr std::uint32_t kEarlier = 0x02FF;
constexpr std::uint32_t kLater = 0x0011;
ByteList TwoCandidates() { return Hex("FF 81 02 FF 81 00 11 91"); }

// What is found of `bytes`, `gap` bad bytes behind a frame of `last`.
std::vector<std::uint32_t> FoundBehind(std::uint32_t last, std::size_t gap, const ByteList& bytes, int bits,
                                       StreamParser& parser) {
  ByteList stream = {0x00};
  Append(stream, StreamFrame(last, bits));
  stream.resize(stream.size() + gap, 0);
  Append(stream, bytes);
  std::vector<std::uint32_t> counts;
  for (const auto& each : ParseAll(parser, stream, 7)) {
    if (!each.error) counts.push_back(each.counts);
  }
  EXPECT_EQ(counts.front(), last);
  return {counts.begin() + 1, counts.end()};
}

std::vector<std::uint32_t> FoundOfTwo(std::uint32_t last, std::size_t gap) {
  ByteList bytes = TwoCandidates();
  bytes.resize(bytes.size() + 10, 0);
  StreamParser parser(16);
  const auto found = FoundBehind(last, gap, bytes, 16, parser);
  EXPECT_EQ(parser.ambiguous(), 0) << "none is followed";
  return found;
}

TEST(SaaStreamParser, OfTwoThatNoneFollowsTheOneInStepIsTaken) {
  for (const std::size_t gap : {5U, 10U, 20U}) EXPECT_THAT(FoundOfTwo(kLater, gap), ElementsAre(kEarlier)) << gap;
  for (const std::size_t gap : {2U, 7U, 22U}) EXPECT_THAT(FoundOfTwo(kEarlier, gap), ElementsAre(kLater)) << gap;
}

TEST(SaaStreamParser, OutOfStepTheNearestToTheLastPositionIsTaken) {
  for (const std::size_t gap : {1U, 4U, 14U}) {
    EXPECT_THAT(FoundOfTwo(kEarlier, gap), ElementsAre(kEarlier)) << gap;
    EXPECT_THAT(FoundOfTwo(kLater, gap), ElementsAre(kLater)) << gap;
    EXPECT_THAT(FoundOfTwo((kEarlier + kLater) / 2, gap), ElementsAre(kLater)) << gap << ": both are as near";
  }
}

TEST(SaaStreamParser, AfterThreeFramesOfBadBytesTheLastPositionDecidesNothing) {
  EXPECT_THAT(FoundOfTwo(kEarlier, 16), ElementsAre(kLater));
  EXPECT_THAT(FoundOfTwo(kEarlier, 19), ElementsAre(kLater));
}

TEST(SaaStreamParser, TheOneThatIsFollowedIsTakenAlsoWhereTheOtherIsInStep) {
  ByteList bytes = Hex("FF 81 02");  // the begin of a frame whose end is missing
  Append(bytes, StreamFrame(kLater, 16));
  Append(bytes, StreamFrame(kLater + 1, 16));
  StreamParser parser(16);
  EXPECT_THAT(FoundBehind(kEarlier, 0, bytes, 16, parser), ElementsAre(kLater, kLater + 1));
}

TEST(SaaStreamParser, WaitsForNoMoreBytesThanTheCandidatesNeed) {
  ByteList bytes = TwoCandidates();
  bytes.push_back(0x00);  // no frame follows the later one
  StreamParser parser(16);
  EXPECT_THAT(FoundBehind(kLater, 5, bytes, 16, parser), ElementsAre(kEarlier));
}

// 24 bits at rest on FF8101 read as 0101FF two bytes later: each is followed.
TEST(SaaStreamParser, OfTwoThatAreFollowedTheNearestIsTakenWithinThreeFrames) {
  ByteList bytes;
  for (int i = 0; i < 4; ++i) Append(bytes, StreamFrame(0xFF8101, 24));
  const auto found = [&bytes](std::uint32_t last, std::size_t gap) {
    StreamParser parser(24);
    const auto counts = FoundBehind(last, gap, bytes, 24, parser);
    EXPECT_EQ(parser.ambiguous() > 0, counts.empty());
    return std::set<std::uint32_t>(counts.begin(), counts.end());
  };
  for (const std::size_t gap : {1U, 13U, 18U}) EXPECT_THAT(found(0xFF8001, gap), ElementsAre(0xFF8101)) << gap;
  for (const std::size_t gap : {1U, 13U, 16U}) EXPECT_THAT(found(0x010200, gap), ElementsAre(0x0101FF)) << gap;
  EXPECT_THAT(found(0x010200, 0), ElementsAre(0xFF8101)) << "it begins where the last frame ended";
  EXPECT_THAT(found(0xFF8001, 19), IsEmpty());
}

TEST(SaaStreamParser, CountsOneErrorForEachFrameLost) {
  StreamParser parser(14);
  ByteList stream = Hex("7F 00");  // received from the middle of a frame: nothing is lost
  for (int i = 0; i < 2; ++i) Append(stream, StreamFrame(383, 14));
  Append(stream, Hex("FF 81 01 7F 01"));
  Append(stream, StreamFrame(0x4000, 16));  // above 14 bits
  for (int i = 0; i < 2; ++i) Append(stream, StreamFrame(383, 14));
  for (int i = 0; i < 20; ++i) stream.push_back(0x55);
  std::vector<ErrorKind> errors;
  for (const auto& each : ParseAll(parser, stream, 11)) {
    if (each.error) errors.push_back(*each.error);
  }
  EXPECT_THAT(errors, ElementsAre(ErrorKind::kChecksum, ErrorKind::kChecksum, ErrorKind::kChecksum,
                                  ErrorKind::kChecksum, ErrorKind::kChecksum));
  EXPECT_EQ(parser.skipped(), 2 + 10 + 20 - 4) << "the last four may still become a frame";
}

TEST(SaaStreamParser, BitsAboveTheResolutionAreRangeErrors) {
  ByteList stream;
  for (int i = 0; i < 2; ++i) Append(stream, StreamFrame(383, 14));
  Append(stream, StreamFrame(0x4000, 16));
  StreamParser parser(14);
  const auto found = ParseAll(parser, stream, 5);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found.back().error, ErrorKind::kRange);
}

TEST(SaaStreamParser, GivesTheArrivalOfFirstAndLastByteAndWhatCameBehind) {
  StreamParser parser(14);
  ByteList stream;
  for (int i = 0; i < 2; ++i) Append(stream, StreamFrame(1, 14));
  parser.Append(Bytes(stream).first(3), {100, 110});
  parser.Append(Bytes(stream).subspan(3), {110, 120});
  const auto first = parser.Next();
  ASSERT_TRUE(first && !first->error);
  EXPECT_EQ(first->first, (Interval{100, 110}));
  EXPECT_EQ(first->last, (Interval{110, 120}));
  EXPECT_EQ(first->behind, 5U);
  EXPECT_EQ(parser.Next()->behind, 0U);
  EXPECT_FALSE(parser.Next());
}

TEST(SaaStreamParser, AnErrorIsOfTheTimeAtWhichItsByteCame) {
  StreamParser parser(14);
  parser.Append(StreamFrame(1, 14), {100, 110});
  ASSERT_TRUE(parser.Next());
  parser.Append(Hex("55"), {200, 210});
  parser.Append(Hex("55"), {300, 310});
  parser.Append(Hex("55 55 55"), {400, 410});
  const auto lost = parser.Next();
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->error, ErrorKind::kChecksum);
  EXPECT_EQ(lost->first, (Interval{200, 210}));
}

TEST(SaaStreamParser, AfterARestartNothingOldIsLeft) {
  StreamParser parser(14);
  EXPECT_THAT(FramePlaces(ParseAll(parser, Hex("FF 81 01"), 3)), IsEmpty());
  parser.Restart();
  ByteList stream = Hex("7F 00");
  Append(stream, StreamFrame(5, 14));
  Append(stream, StreamFrame(6, 14));
  EXPECT_THAT(FramePlaces(ParseAll(parser, stream, 20)), ElementsAre(5, 10));
}

TEST(SaaStreamParser, ARestartAmidWhatWasReadFindsTheNextFrame) {
  StreamParser parser(14);
  ByteList two = StreamFrame(1, 14);
  Append(two, StreamFrame(2, 14));
  parser.Append(two, {0, 1});
  ASSERT_TRUE(parser.Next());
  parser.Restart();
  ByteList next = {0x00};  // who begins to listen amid a frame has lost nothing
  Append(next, StreamFrame(3, 14));
  parser.Append(next, {2, 3});
  const auto found = parser.Next();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->error, std::nullopt);
  EXPECT_EQ(found->counts, 3U);
}

TEST(SaaStreamParser, ARestartForgetsTheBadBytesBeforeIt) {
  StreamParser parser(14);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(ParseAll(parser, ByteList(8, 0x00), 8).empty()) << i;  // four bytes of which none begins a frame
    parser.Restart();
  }
}

TEST(SaaStreamParser, OnlyAFrameThatEndsInTheNewestReadKnowsWhatCameBehindIt) {
  StreamParser parser(14);
  ByteList three = StreamFrame(1, 14);
  Append(three, StreamFrame(2, 14));
  Append(three, StreamFrame(3, 14));
  parser.Append(Bytes(three).first(7), {0, 1});
  parser.Append(Bytes(three).subspan(7), {2, 3});
  EXPECT_EQ(parser.Next()->behind, std::nullopt);
  EXPECT_EQ(parser.Next()->behind, 5U);
  EXPECT_EQ(parser.Next()->behind, 0U);
}

TEST(SaaStreamParser, AByteThatIsNoHeaderEndsTheWaitBehindAChecksumOfFF) {
  ByteList frame = StreamFrame(0x007F, 14);
  ASSERT_EQ(frame.back(), 0xFF);
  StreamParser parser(14);
  parser.Append(frame, {0, 1});
  EXPECT_FALSE(parser.Next()) << "its checksum may be the start of a frame";
  parser.Append(ByteList{0x00}, {2, 3});
  const auto found = parser.Next();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->counts, 0x7FU);
}

}  // namespace
}  // namespace axlecast::saa_serial
