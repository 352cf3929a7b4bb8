#include "tools/log/log_name.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

constexpr std::int64_t kNow = 1'795'244'405'000'000;  // date -u -d @1795244405: 2026-11-21 07:00:05

TEST(LogFileName, IsNameAndUtcTime) {
  EXPECT_EQ(LogFileName("press3", kNow + 999'999, 0), "press3_20261121T070005Z.lcm");
  EXPECT_EQ(LogFileName("press3", kNow, 7), "press3_20261121T070005Z_007.lcm");
  EXPECT_EQ(LogFileName("press3", kNow, 1'234), "press3_20261121T070005Z_1234.lcm");
}

TEST(LogFileBegin, ReadsOnlyOwnNames) {
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z.lcm"), kNow);
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z_007.lcm"), kNow);
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z.lcm.zst"), kNow);
  EXPECT_EQ(LogFileBegin("press3", "press3_20261121T070005Z_007.lcm.zst"), kNow);
  for (const char* file : {"press3_20261121T070005Z.log",
                           "press4_20261121T070005Z.lcm",
                           "press3_20261121T070005Z_x.lcm",
                           "press3.lcm",
                           "press3_20261121T070005Z_007.lcm.bak",
                           "press3_20261121T070005Z_.lcm",
                           "press3_20261121T070005.lcm",
                           "press3_2026-11-21T070005Z.lcm",
                           "press3_important.lcm",
                           "press33_20261121T070005Z.lcm",
                           "press3_20261321T070005Z.lcm",
                           "press3_20261121T070005Zcopy.lcm",
                           "press3-20261121T070005Z.lcm",
                           "press3_20261121T070005Z_07.lcm",
                           "press3_20261121T070005Z-007.lcm",
                           "press3_20261121T070005Z_0x7.lcm",
                           "press3_20261121T07000.lcm",
                           "press3_.lcm",
                           "press3_20261121T070005Z.zst",
                           "press3_20261121T070005Z.lcm.gz",
                           "press3_20261121T070005Z.lcm.zst.zst",
                           "press3_20261121T070005Z.lcm.zst.Ab1234"}) {
    EXPECT_FALSE(LogFileBegin("press3", file)) << file;
  }
}

TEST(LogFilePrefix, IsThePartBeforeTheTime) {
  EXPECT_EQ(LogFilePrefix("press3-positions_20261121T070005Z.lcm"), "press3-positions");
  EXPECT_EQ(LogFilePrefix("a_b_20261121T070005Z_007.lcm.zst"), "a_b");
  for (const char* file : {"", "_", "_20261121T070005Z.lcm", "run.lcm", "run_001.lcm", "20261121T070005Z.lcm"}) {
    EXPECT_EQ(LogFilePrefix(file), "") << file;
  }
}

TEST(PlainLogName, IsTheNameBeforeTheCompression) {
  EXPECT_EQ(PlainLogName("run.lcm.zst"), "run.lcm");
  EXPECT_EQ(PlainLogName("run.lcm"), "run.lcm");
  EXPECT_EQ(PlainLogName(".zst"), "");
}

TEST(LogExists, InEitherForm) {
  const TemporaryFolder folder;
  EXPECT_FALSE(LogExists(folder.path(), "a.lcm"));
  std::ofstream(folder.path() + "/a.lcm") << "x";
  std::ofstream(folder.path() + "/b.lcm.zst") << "x";
  EXPECT_TRUE(LogExists(folder.path(), "a.lcm"));
  EXPECT_TRUE(LogExists(folder.path(), "b.lcm"));
  EXPECT_FALSE(LogExists(folder.path(), "c.lcm"));
  EXPECT_FALSE(LogExists(folder.path() + "/nowhere", "a.lcm"));
}

}  // namespace
}  // namespace axlecast
