#include "tools/log/compressed_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include "tests/support/temporary_folder.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Content = std::vector<std::uint8_t>;

// Compresses to about a third.
Content Sample(std::size_t size, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  Content content(size);
  for (std::uint8_t& byte : content) byte = static_cast<std::uint8_t>('a' + random() % 8);
  return content;
}

// Frames of `frame` bytes each. Returns the offset of each frame in `offsets`.
Content Compressed(Bytes content, std::size_t frame, std::vector<std::size_t>* offsets = nullptr) {
  LogCompressor compressor;
  Content file;
  for (std::size_t begin = 0; begin < content.size(); begin += frame) {
    const auto bytes = compressor.Compress(content.subspan(begin, std::min(frame, content.size() - begin)));
    EXPECT_TRUE(bytes);
    if (offsets != nullptr) offsets->push_back(file.size());
    file.insert(file.end(), bytes->begin(), bytes->end());
  }
  return file;
}

struct Read {
  Content content;
  std::vector<CompressedDamage> damage;
};

Read ReadAll(Bytes file) {
  Read read;
  read.damage = Decompress(file, [&](Bytes piece, std::size_t position) {
    EXPECT_LE(position, file.size());
    read.content.insert(read.content.end(), piece.begin(), piece.end());
    return true;
  });
  return read;
}

TEST(CompressedLog, IsReadBackFromItsFrames) {
  const Content content = Sample(2'000'000);
  Content file = Compressed(content, 300'000);
  EXPECT_TRUE(IsCompressed(file));
  EXPECT_LT(file.size(), content.size() / 2);
  const Content summary = EncodeSummary({.bytes = content.size(), .first_utime = 5, .last_utime = -6});
  file.insert(file.end(), summary.begin(), summary.end());
  const Read read = ReadAll(file);
  EXPECT_EQ(read.content, content);
  EXPECT_THAT(read.damage, IsEmpty());
  EXPECT_EQ(FindSummary(file), (CompressedLogSummary{.bytes = content.size(), .first_utime = 5, .last_utime = -6}));
}

TEST(CompressedLog, AFrameTakesEightMebibytes) {
  const Content content = Sample(kFrameBytes);
  EXPECT_EQ(ReadAll(Compressed(content, kFrameBytes)).content, content);
}

TEST(CompressedLog, ALogIsNotCompressed) {
  Content log;
  AppendEvent(log, {0, 1, "A", {}});
  EXPECT_FALSE(IsCompressed(log));
  EXPECT_FALSE(IsCompressed({}));
  EXPECT_FALSE(IsCompressed(Bytes(EncodeSummary({})).first(3)));
  EXPECT_TRUE(IsCompressed(EncodeSummary({})));
}

TEST(CompressedLog, OnlyAWholeSummaryAtTheEndCounts) {
  const Content summary = EncodeSummary({.bytes = 7, .first_utime = 1, .last_utime = 2});
  ASSERT_THAT(summary, SizeIs(40));
  for (std::size_t i = 0; i < 16; ++i) {
    Content changed = summary;
    changed[i] ^= 0x10U;
    EXPECT_FALSE(FindSummary(changed)) << i;
  }
  EXPECT_FALSE(FindSummary(Bytes(summary).first(39)));
  Content more = summary;
  more.push_back(0);
  EXPECT_FALSE(FindSummary(more));
  EXPECT_FALSE(FindSummary({}));
}

TEST(CompressedLog, StopsWhenEnoughWasRead) {
  const Content file = Compressed(Sample(2'000'000), 500'000);
  std::size_t pieces = 0;
  EXPECT_THAT(Decompress(file,
                         [&](Bytes, std::size_t) {
                           ++pieces;
                           return false;
                         }),
              IsEmpty());
  EXPECT_EQ(pieces, 1U);
}

TEST(CompressedLog, AMissingEndIsDamage) {
  std::vector<std::size_t> offsets;
  const Content content = Sample(900'000);
  const Content file = Compressed(content, 300'000, &offsets);
  for (const std::size_t size : {offsets[1], offsets[1] + 1, offsets[1] + 5, offsets[2] - 1, file.size() - 1}) {
    const Read read = ReadAll(Bytes(file).first(size));
    const std::size_t begin = size > offsets[2] ? offsets[2] : offsets[1];
    if (size == offsets[1]) {
      EXPECT_THAT(read.damage, IsEmpty());
    } else {
      EXPECT_THAT(read.damage, ElementsAre(CompressedDamage{begin, size - begin})) << size;
    }
    EXPECT_GE(read.content.size(), begin == offsets[2] ? 600'000U : 300'000U);
    EXPECT_TRUE(std::equal(read.content.begin(), read.content.end(), content.begin()));
  }
}

TEST(CompressedLog, TheFramesAroundDamageAreRead) {
  std::vector<std::size_t> offsets;
  const Content content = Sample(900'000);
  const Content file = Compressed(content, 300'000, &offsets);
  std::mt19937_64 random(3);
  for (int i = 0; i < 200; ++i) {
    Content changed = file;
    const std::size_t at = offsets[1] + random() % (offsets[2] - offsets[1]);
    for (std::size_t k = at; k < std::min(at + 1 + random() % 64, offsets[2]); ++k)
      changed[k] ^= static_cast<std::uint8_t>(1 + random() % 255);
    const Read read = ReadAll(changed);
    ASSERT_FALSE(read.damage.empty()) << at;
    EXPECT_GE(read.damage.front().offset, offsets[1]);
    EXPECT_LE(read.damage.back().offset + read.damage.back().size, offsets[2]) << at;
    ASSERT_GE(read.content.size(), 600'000U);
    EXPECT_TRUE(std::equal(content.begin(), content.begin() + 300'000, read.content.begin()));
    EXPECT_TRUE(std::equal(content.end() - 300'000, content.end(), read.content.end() - 300'000)) << at;
  }
}

TEST(CompressedLog, AFrameWithAWrongChecksumIsReadToItsEnd) {
  std::vector<std::size_t> offsets;
  const Content content = Sample(900'000);
  Content file = Compressed(content, 300'000, &offsets);
  file[offsets[1] - 1] ^= 1;
  const Read read = ReadAll(file);
  EXPECT_EQ(read.content, content);
  EXPECT_THAT(read.damage, ElementsAre(CompressedDamage{0, offsets[1]}));
}

TEST(CompressedLog, BytesBetweenFramesAreDamage) {
  const Content first = Compressed(Sample(1'000), 1'000);
  Content file = first;
  file.insert(file.end(), 100, 0x55);
  file.insert(file.end(), first.begin(), first.end());
  file.insert(file.end(), 3, 0x28);
  const Read read = ReadAll(file);
  EXPECT_THAT(read.content, SizeIs(2'000));
  EXPECT_THAT(read.damage, ElementsAre(CompressedDamage{first.size(), 100}, CompressedDamage{file.size() - 3, 3}));
  EXPECT_THAT(ReadAll(Content(50, 1)).damage, ElementsAre(CompressedDamage{0, 50}));
  EXPECT_THAT(ReadAll({}).damage, IsEmpty());
}

// The program of the format's authors.
class ZstdProgramTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(std::system("zstd --version > /dev/null 2>&1"), 0) << "package zstd is missing";
  }
  void Store(const std::string& file, Bytes content) const {
    std::ofstream(folder_.path() + '/' + file, std::ios::binary) << AsText(content);
  }
  [[nodiscard]] Content Load(const std::string& file) const {
    std::ifstream stream(folder_.path() + '/' + file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] int Run(const std::string& arguments) const {
    return std::system(("cd '" + folder_.path() + "' && zstd -q " + arguments).c_str());
  }

  const TemporaryFolder folder_;
};

TEST_F(ZstdProgramTest, ReadsOurs) {
  const Content content = Sample(1'000'000);
  Content file = Compressed(content, 300'000);
  const Content summary = EncodeSummary({.bytes = content.size(), .first_utime = 1, .last_utime = 2});
  file.insert(file.end(), summary.begin(), summary.end());
  Store("run.lcm.zst", file);
  EXPECT_EQ(Run("-t run.lcm.zst"), 0);
  ASSERT_EQ(Run("-d run.lcm.zst"), 0);
  EXPECT_EQ(Load("run.lcm"), content);
  file[file.size() / 2] ^= 0xFFU;
  Store("bad.lcm.zst", file);
  EXPECT_NE(Run("-t bad.lcm.zst 2> /dev/null"), 0) << "each frame has a checksum";
}

TEST_F(ZstdProgramTest, WritesWhatWeRead) {
  const Content content = Sample(600'000);
  Store("run.lcm", content);
  for (const char* options : {"-1", "-19", "--no-check -3", "--long=27 -5", "--no-content-size -3"}) {
    ASSERT_EQ(Run(std::string("-f ") + options + " run.lcm"), 0);
    const Read read = ReadAll(Load("run.lcm.zst"));
    EXPECT_EQ(read.content, content) << options;
    EXPECT_THAT(read.damage, IsEmpty()) << options;
  }
}

}  // namespace
}  // namespace axlecast
