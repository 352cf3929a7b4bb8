// What damage costs: frames that are known to be good, between bytes that are known to be bad.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "drivers/kit/simulation/simulated_fault.h"
#include "drivers/saa_serial/stream_parser.h"
#include "drivers/saa_serial/stream_test_support.h"
#include "tests/support/thorough.h"

namespace axlecast::saa_serial {
namespace {

struct Stream {
  ByteList bytes;
  std::set<std::int64_t> good;  // places of the undamaged frames

  void Good(std::uint32_t counts, int bits) {
    good.insert(static_cast<std::int64_t>(bytes.size()));
    Append(bytes, StreamFrame(counts, bits));
  }
  void Bad(const ByteList& more) { Append(bytes, more); }
};

std::vector<StreamParser::Found> Parsed(const Stream& stream, int bits, std::size_t chunk) {
  StreamParser parser(bits);
  ByteList padded = stream.bytes;
  padded.resize(padded.size() + 3 * ReplySize(bits), 0);  // to see what overlaps the last
  return ParseAll(parser, padded, chunk);
}

std::set<std::int64_t> Lost(const Stream& stream, const std::vector<StreamParser::Found>& found) {
  const std::vector<std::int64_t> places = FramePlaces(found);
  std::set<std::int64_t> lost;
  std::set_difference(stream.good.begin(), stream.good.end(), places.begin(), places.end(),
                      std::inserter(lost, lost.begin()));
  return lost;
}

constexpr std::array<int, 7> kWidths = {10, 14, 16, 17, 24, 25, 26};

// A shaft that turns: the damage of one frame's bytes costs that frame, and no other.
void OneFrameIsLost(const std::function<ByteList(ByteList frame, std::size_t at)>& damage) {
  SeededRandom random(3);
  for (const int bits : kWidths) {
    for (int round = 0; round < 40; ++round) {
      auto counts = static_cast<std::uint32_t>(random.Next());
      const auto step = static_cast<std::uint32_t>(random.Next() % 1'000);
      const std::size_t at = random.Next() % ReplySize(bits);
      Stream stream;
      ByteList bad;
      for (int frame = 0; frame < 12; ++frame) {
        counts = (counts + step) % (1U << static_cast<unsigned>(bits));
        if (frame != 6) {
          stream.Good(counts, bits);
          continue;
        }
        bad = damage(StreamFrame(counts, bits), at);
        stream.Bad(bad);
      }
      const auto found = Parsed(stream, bits, 1 + random.Next() % 30);
      ASSERT_TRUE(Lost(stream, found).empty()) << bits << " bits, byte " << at << ", round " << round;
      const auto frames = static_cast<std::size_t>(
          std::count_if(found.begin(), found.end(), [](const auto& each) { return !each.error; }));
      ASSERT_LE(frames, stream.good.size() + 1);
    }
  }
}

TEST(SaaStreamDamage, AChangedByteCostsItsFrame) {
  for (unsigned change = 1; change < 256; change += StepOfValues(5U)) {
    OneFrameIsLost([change](ByteList frame, std::size_t at) {
      frame[at] = static_cast<std::uint8_t>(frame[at] ^ change);
      return frame;
    });
    if (::testing::Test::HasFatalFailure()) FAIL() << change;
  }
}

TEST(SaaStreamDamage, AMissingByteCostsItsFrame) {
  OneFrameIsLost([](ByteList frame, std::size_t at) {
    frame.erase(frame.begin() + static_cast<std::ptrdiff_t>(at));
    return frame;
  });
}

TEST(SaaStreamDamage, AByteTooManyCostsItsFrame) {
  for (unsigned value = 0; value < 256; value += StepOfValues(5U)) {
    OneFrameIsLost([value](ByteList frame, std::size_t at) {
      frame.insert(frame.begin() + static_cast<std::ptrdiff_t>(at), static_cast<std::uint8_t>(value));
      return frame;
    });
    if (::testing::Test::HasFatalFailure()) FAIL() << value;
  }
}

TEST(SaaStreamDamage, AWholeBurstOfNoiseCostsTheFramesThatItHits) {
  SeededRandom random(4);
  OneFrameIsLost([&random](const ByteList&, std::size_t) {
    ByteList noise(random.Next() % 40);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random.Next());
    return noise;
  });
}

// Positions and noise made of the bytes that look-alikes need, as no line would have them.
class Adversary {
 public:
  Adversary(int bits, std::uint64_t seed) : bits_(bits), random_(seed) {}

  Stream Make(int pieces) {
    Stream stream;
    std::uint32_t counts = 0;
    for (int i = 0; i < pieces; ++i) {
      if (random_.Next() % 3 > 0) counts = Counts();
      if (random_.Next() % 3 > 0) {
        stream.Good(counts, bits_);
        continue;
      }
      ByteList bad = random_.Next() % 2 == 0 ? Noise() : StreamFrame(counts, bits_);
      if (!bad.empty()) bad.erase(bad.begin() + static_cast<std::ptrdiff_t>(random_.Next() % bad.size()));
      stream.Bad(bad);
    }
    return stream;
  }
  std::size_t Chunk() { return 1 + random_.Next() % 30; }

 private:
  std::uint8_t Byte() {
    constexpr std::array<std::uint8_t, 6> kBytes = {0xFF, 0x81, 0x02, 0x00, 0x01, 0x80};
    return kBytes.at(random_.Next() % kBytes.size());
  }
  std::uint32_t Counts() {
    std::uint32_t counts = 0;
    for (int i = 0; i < 4; ++i) counts = counts << 8U | Byte();
    return counts % (1U << static_cast<unsigned>(bits_));
  }
  ByteList Noise() {
    ByteList noise(random_.Next() % 9);
    for (std::uint8_t& byte : noise) byte = Byte();
    return noise;
  }

  int bits_;
  SeededRandom random_;
};

// "A good frame that a good frame follows is always found, whatever came before it", with its one exception.
TEST(SaaStreamDamage, UpToSixteenBitsAGoodFrameThatAGoodOneFollowsIsAlwaysFound) {
  int seen = 0;
  for (const int bits : {10, 14, 15, 16}) {
    for (std::uint64_t seed = 0; seed < Times(8'000U, 4U); ++seed) {
      Adversary adversary(bits, seed);
      const Stream stream = adversary.Make(14);
      const auto found = Parsed(stream, bits, adversary.Chunk());
      for (const std::int64_t place : Lost(stream, found)) {
        if (!stream.good.contains(place + 5)) continue;
        FAIL() << bits << " bits, seed " << seed << ", at " << place;
      }
      seen += static_cast<int>(stream.good.size());
    }
  }
  EXPECT_GT(seen, Times(100'000, 4));
}

// Above: only where the bytes can be read in two ways and nothing was found lately.
TEST(SaaStreamDamage, AboveSixteenBitsOnlyWhatCanBeReadInTwoWaysIsLost) {
  for (const int bits : {17, 20, 24, 25, 26}) {
    const auto size = static_cast<std::int64_t>(ReplySize(bits));
    for (std::uint64_t seed = 0; seed < Times(8'000U, 4U); ++seed) {
      Adversary adversary(bits, seed);
      const Stream stream = adversary.Make(14);
      const auto found = Parsed(stream, bits, adversary.Chunk());
      const std::set<std::int64_t> all = NaiveFrames(stream.bytes, bits);
      for (const std::int64_t place : Lost(stream, found)) {
        if (!stream.good.contains(place + size) || !stream.good.contains(place - size)) continue;
        bool rival = false;
        for (std::int64_t at = place - size + 1; at < place + size; ++at) {
          rival =
              rival || (at != place && all.contains(at) && (all.contains(at + size) || all.contains(at - size)));
        }
        ASSERT_TRUE(rival) << bits << " bits, seed " << seed << ", at " << place;
      }
    }
  }
}

}  // namespace
}  // namespace axlecast::saa_serial
