#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>
#include <string_view>

#include "bridge/store/sqlite_store.h"
#include "platform/os/descriptor.h"
#include "platform/os/folder.h"
#include "platform/os/log_file.h"
#include "platform/os/new_file.h"
#include "tests/disk/memory_folder.h"
#include "tests/disk/recorded_disk.h"

namespace axlecast {
namespace {

// Names that a power failure must not take away with the files behind them.
class DurableNamesTest : public ::testing::Test {
 protected:
  DurableNamesTest() { std::filesystem::create_directory(live_); }

  // Cuts the power now; nothing that is not synced survives.
  [[nodiscard]] std::string Survivor(const RecordedDisk& disk, const std::string& name) const {
    const std::string target = memory_.path() + "/cut";
    disk.Cut(disk.position(), {CutChoice::Kind::kNothing}, target);
    return target + '/' + name;
  }

  const MemoryFolder memory_;
  const std::string live_ = memory_.path() + "/live";
};

TEST_F(DurableNamesTest, NewFoldersSurvive) {
  const RecordedDisk disk(live_);
  ASSERT_TRUE(MakeFolders(live_ + "/one/two", 0700));
  EXPECT_TRUE(std::filesystem::is_directory(Survivor(disk, "one/two")));
}

TEST_F(DurableNamesTest, FoldersThatAKilledProcessHasLeftSurvive) {
  const RecordedDisk disk(live_);
  ASSERT_EQ(mkdir((live_ + "/one").c_str(), 0700), 0);
  ASSERT_EQ(mkdir((live_ + "/one/two").c_str(), 0700), 0);
  ASSERT_FALSE(std::filesystem::exists(Survivor(disk, "one")));
  ASSERT_TRUE(MakeFolders(live_ + "/one/two", 0700));
  EXPECT_TRUE(std::filesystem::is_directory(Survivor(disk, "one/two")));
}

TEST_F(DurableNamesTest, AFileInPlaceOfAFolderIsReported) {
  ASSERT_TRUE(WriteNewFile(live_ + "/one", "", {}, false));
  EXPECT_FALSE(MakeFolders(live_ + "/one", 0700));
  EXPECT_FALSE(MakeFolders(live_ + "/one/two", 0700));
}

TEST_F(DurableNamesTest, AJournalThatAKilledBridgeHasCreatedSurvives) {
  const RecordedDisk disk(live_);
  const std::string file = live_ + "/state/journal.db";
  ASSERT_TRUE(PrepareFile(file));
  {
    SqliteStore store(file, "press3");
    ASSERT_TRUE(store.Apply("axis1", IdentityChanged{"A1"}));
    const SqliteStore after(Survivor(disk, "state/journal.db"), "press3");
    EXPECT_TRUE(after.state());
    EXPECT_EQ(after.Find("axis1").identity, "A1");
  }
}

// The recorder was killed between the creation of the log and its first sync. It is then continued.
TEST_F(DurableNamesTest, ALogThatAKilledRecorderHasLeftSurvives) {
  const RecordedDisk disk(live_);
  const std::string path = live_ + "/run.lcm";
  {
    const Descriptor killed(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0644));
    ASSERT_EQ(write(killed.get(), "begin", 5), 5);
  }
  LogFile log;
  ASSERT_EQ(log.Continue(path, 5), 0);
  const std::array<std::uint8_t, 3> more = {'e', 'n', 'd'};
  Bytes rest = more;
  ASSERT_EQ(log.Write(rest), 0);
  ASSERT_EQ(log.Sync(), 0);
  const std::string survivor = Survivor(disk, "run.lcm");
  ASSERT_TRUE(std::filesystem::exists(survivor));
  EXPECT_EQ(std::filesystem::file_size(survivor), 8U);
}

TEST_F(DurableNamesTest, TheKeptNameSurvivesBeforeTheFileIsReplaced) {
  ASSERT_TRUE(WriteNewFile(live_ + "/run.lcm", "damaged", {}, false));
  const RecordedDisk disk(live_);
  NewFile repaired(live_ + "/run.lcm", {});
  ASSERT_TRUE(repaired.Append("whole"));
  ASSERT_TRUE(repaired.Commit(true, live_ + "/run.lcm.damaged"));
  const std::string target = memory_.path() + "/cut";
  for (std::size_t point = 0; point <= disk.position(); ++point) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      disk.Cut(point, {CutChoice::Kind::kRandom, seed}, target);
      const bool replaced = std::filesystem::file_size(target + "/run.lcm") == std::string_view("whole").size();
      EXPECT_TRUE(!replaced || std::filesystem::exists(target + "/run.lcm.damaged")) << "point " << point;
    }
  }
}

}  // namespace
}  // namespace axlecast
