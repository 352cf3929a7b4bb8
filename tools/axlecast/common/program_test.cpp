#include <gtest/gtest.h>
#include <filesystem>

#include "core/base/text.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/common/program.h"

namespace axlecast {
namespace {

TEST(ShellText, QuotesWhatAShellWouldChange) {
  EXPECT_EQ(ShellText({"env", "URL=udpm://239.255.76.67:7667?ttl=0", "a b", "it's", ""}),
            "env 'URL=udpm://239.255.76.67:7667?ttl=0' 'a b' 'it'\\''s' ''");
}

TEST(DriverProgram, FollowsTheFamilysName) {
  EXPECT_EQ(DriverProgram("tsubaki_sc"), ProgramFolder() + "/axlecast-tsubaki-sc");
}

TEST(ProcessLog, KeepsAtMostTwoFilesOfTheLimit) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/driver.log";
  ProcessLog log(path, 100);
  for (int i = 0; i < 50; ++i) log.Write("123456789");
  EXPECT_LE(std::filesystem::file_size(path), 100U);
  EXPECT_EQ(std::filesystem::file_size(path + ".1"), 100U);
}

TEST(ProcessLog, WithoutADirectoryNothingHappens) {
  ProcessLog log("/nonexistent/driver.log");
  log.Write("lost");
}

TEST(WorthShowing, AllButInformation) {
  EXPECT_FALSE(WorthShowing("[2026-01-01 00:00:00.000] [rs485-0] [info] up"));
  EXPECT_TRUE(WorthShowing("[2026-01-01 00:00:00.000] [rs485-0] [warning] late"));
  EXPECT_FALSE(WorthShowing("2026-01-01T00:00:00.000Z info rs485-0: stopped"));
  EXPECT_TRUE(WorthShowing("2026-01-01T00:00:00.000Z warning rs485-0: no info"));
  EXPECT_TRUE(WorthShowing("error while loading shared libraries: liblcm.so.1"));
  EXPECT_FALSE(WorthShowing(""));
}

}  // namespace

}  // namespace axlecast
