#include "tests/disk/recorded_disk.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>

#include "bridge/store/sqlite_store.h"
#include "platform/os/descriptor.h"
#include "platform/os/new_file.h"
#include "tests/disk/memory_folder.h"

namespace axlecast {
namespace {

using Kind = CutChoice::Kind;

std::string Content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return file ? std::string(std::istreambuf_iterator<char>(file), {}) : "(missing)";
}

// Path and content of every file below a folder.
std::map<std::string, std::string> FilesBelow(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string name = std::filesystem::relative(entry.path(), folder).string();
    files[name] = entry.is_directory() ? "(folder)" : Content(entry.path().string());
  }
  return files;
}

class RecordedDiskTest : public ::testing::Test {
 protected:
  RecordedDiskTest() { std::filesystem::create_directory(live_); }

  Descriptor Open(const std::string& name, int flags = O_RDWR | O_CREAT) const {
    return Descriptor(open((live_ + '/' + name).c_str(), flags, 0640));
  }
  static void Write(const Descriptor& file, const std::string& text, off_t at) {
    ASSERT_EQ(pwrite(file.get(), text.data(), text.size(), at), static_cast<ssize_t>(text.size()));
  }
  void SyncLive() const { ASSERT_EQ(SyncFolderOf(live_ + "/x"), 0); }
  // The file after a cut now.
  std::string After(const RecordedDisk& disk, const std::string& name, Kind kind, std::uint64_t seed = 0) const {
    disk.Cut(disk.position(), {kind, seed}, cut_);
    return Content(cut_ + '/' + name);
  }
  // What the file may be after a cut now.
  std::set<std::string> Possible(const RecordedDisk& disk, const std::string& name) const {
    std::set<std::string> contents;
    for (std::uint64_t seed = 0; seed < 500; ++seed) contents.insert(After(disk, name, Kind::kRandom, seed));
    return contents;
  }

  const MemoryFolder folder_;
  const std::string live_ = folder_.path() + "/live";
  const std::string cut_ = folder_.path() + "/cut";
};

TEST_F(RecordedDiskTest, AFileNeedsASyncOfItselfAndOfItsFolder) {
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, "text", 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "(missing)");
  EXPECT_EQ(After(disk, "a", Kind::kEverything), "text");
  ASSERT_EQ(fsync(file.get()), 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "(missing)");
  SyncLive();
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "text");
}

TEST_F(RecordedDiskTest, AFolderThatIsNotInTheFolderAboveTakesItsFilesWithIt) {
  const RecordedDisk disk(live_);
  ASSERT_EQ(mkdir((live_ + "/sub").c_str(), 0700), 0);
  ASSERT_TRUE(WriteNewFile(live_ + "/sub/a", "text", {}, false));
  EXPECT_EQ(After(disk, "sub/a", Kind::kNothing), "(missing)");
  SyncLive();
  EXPECT_EQ(After(disk, "sub/a", Kind::kNothing), "text");
}

TEST_F(RecordedDiskTest, SectorsOfOneWriteAreKeptOrLostOneByOne) {
  const std::string before = std::string(512, 'a') + std::string(512, 'b');
  const std::string after = std::string(512, 'c') + std::string(512, 'd');
  ASSERT_TRUE(WriteNewFile(live_ + "/a", before, {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, after, 0);
  const std::set<std::string> possible = {before, after, std::string(512, 'a') + std::string(512, 'd'),
                                          std::string(512, 'c') + std::string(512, 'b')};
  EXPECT_EQ(Possible(disk, "a"), possible);
  EXPECT_EQ(After(disk, "a", Kind::kTorn), std::string(512, 'c') + std::string(512, 'b'));
}

TEST_F(RecordedDiskTest, ASectorHasItsValueAfterOneOfItsWrites) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "0000", {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, "11", 0);
  Write(file, "22", 2);
  Write(file, "3", 1);
  EXPECT_EQ(Possible(disk, "a"), (std::set<std::string>{"0000", "1100", "1122", "1322"}));
}

TEST_F(RecordedDiskTest, AFileThatGrewHoldsZerosOrAnythingWhereItsDataIsMissing) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "", {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, "text", 0);
  const std::set<std::string> possible = Possible(disk, "a");
  EXPECT_TRUE(possible.contains(""));
  EXPECT_TRUE(possible.contains("text"));
  EXPECT_TRUE(possible.contains(std::string(4, '\0')));
  EXPECT_GT(possible.size(), 3U);
}

TEST_F(RecordedDiskTest, FdatasyncKeepsDataAndGrowthButNotATruncation) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "0123456789", {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, "ab", 10);
  ASSERT_EQ(fdatasync(file.get()), 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "0123456789ab");
  ASSERT_EQ(ftruncate(file.get(), 4), 0);
  ASSERT_EQ(fdatasync(file.get()), 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "0123456789ab");
  ASSERT_EQ(fsync(file.get()), 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "0123");
}

TEST_F(RecordedDiskTest, AWriteAfterALostTruncationIsLost) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "0123456789", {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  ASSERT_EQ(ftruncate(file.get(), 0), 0);
  Write(file, "ab", 0);
  for (const std::string& content : Possible(disk, "a")) {
    EXPECT_TRUE(content == "0123456789" || content.size() == 2 || content.empty()) << content;
  }
}

TEST_F(RecordedDiskTest, ARenameIsKeptOrLostAsAWhole) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "old", {}, false));
  const RecordedDisk disk(live_);
  ASSERT_TRUE(WriteNewFile(live_ + "/b", "new", {}, false));
  ASSERT_EQ(rename((live_ + "/b").c_str(), (live_ + "/a").c_str()), 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "old");
  EXPECT_EQ(After(disk, "b", Kind::kNothing), "new");
  EXPECT_EQ(After(disk, "a", Kind::kEverything), "new");
  EXPECT_EQ(After(disk, "b", Kind::kEverything), "(missing)");
  EXPECT_EQ(Possible(disk, "a"), (std::set<std::string>{"old", "new"}));
}

TEST_F(RecordedDiskTest, ARenameMayComeBeforeTheDataOfItsFile) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "old", {}, false));
  const RecordedDisk disk(live_);
  const Descriptor file = Open("b");
  Write(file, "new", 0);
  ASSERT_EQ(rename((live_ + "/b").c_str(), (live_ + "/a").c_str()), 0);
  EXPECT_TRUE(Possible(disk, "a").contains(""));
}

TEST_F(RecordedDiskTest, RemovalsAndLinksAreEntriesToo) {
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "text", {}, false));
  const RecordedDisk disk(live_);
  ASSERT_EQ(link((live_ + "/a").c_str(), (live_ + "/b").c_str()), 0);
  EXPECT_EQ(After(disk, "b", Kind::kNothing), "(missing)");
  SyncLive();
  EXPECT_EQ(After(disk, "b", Kind::kNothing), "text");
  ASSERT_TRUE(std::filesystem::remove(live_ + "/a"));
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "text");
  SyncLive();
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "(missing)");
}

TEST_F(RecordedDiskTest, PermissionsAreDurableWithTheFile) {
  const RecordedDisk disk(live_);
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "text", {.mode = 0640}, false));
  disk.Cut(disk.position(), {Kind::kNothing}, cut_);
  EXPECT_EQ(std::filesystem::status(cut_ + "/a").permissions(), std::filesystem::perms(0640));
}

// The calls that are not recorded would be missing here.
TEST_F(RecordedDiskTest, EverythingThatTheStoreWritesIsRecorded) {
  const RecordedDisk disk(live_);
  {
    SqliteStore store(live_ + "/state/journal.db", "press3");
    ASSERT_TRUE(store.Apply("axis1", IdentityChanged{"A1"}));
    ASSERT_GT(store.ReserveEpochs(1, 10), 0);
  }
  SqliteStore store(live_ + "/state/journal.db", "press3");
  ASSERT_TRUE(store.Apply("axis1", IdentityChanged{"A2"}));
  disk.Cut(disk.position(), {Kind::kEverything}, cut_);
  auto live = FilesBelow(live_);
  auto cut = FilesBelow(cut_);
  EXPECT_EQ(live.erase("state/journal.db-shm"), 1U);  // mapped
  EXPECT_EQ(cut.erase("state/journal.db-shm"), 1U);
  EXPECT_GT(disk.position(), 100U);
  EXPECT_EQ(cut, live);
}

TEST_F(RecordedDiskTest, TwoDisksRecordOnlyTheirOwnFolder) {
  const std::string other = folder_.path() + "/other";
  std::filesystem::create_directory(other);
  const RecordedDisk one(live_);
  const RecordedDisk two(other);
  ASSERT_TRUE(WriteNewFile(live_ + "/a", "text", {}, false));
  EXPECT_GT(one.position(), 0U);
  EXPECT_EQ(two.position(), 0U);
}

TEST_F(RecordedDiskTest, TheSameSeedGivesTheSameState) {
  const RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, std::string(20'000, 'x'), 0);
  const std::string first = After(disk, "a", Kind::kRandom, 7);
  EXPECT_EQ(After(disk, "a", Kind::kRandom, 7), first);
}

TEST_F(RecordedDiskTest, ForgetTakesTheContentAsDurable) {
  RecordedDisk disk(live_);
  const Descriptor file = Open("a");
  Write(file, "text", 0);
  disk.Forget();
  EXPECT_EQ(disk.position(), 0U);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "text");
  Write(file, "T", 0);
  EXPECT_EQ(After(disk, "a", Kind::kNothing), "text");
  EXPECT_EQ(After(disk, "a", Kind::kEverything), "Text");
}

}  // namespace
}  // namespace axlecast
