#include "platform/os/log_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/disk/file_calls.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

std::string ContentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::int64_t BytesOnDisk(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0);
  return std::int64_t{status.st_blocks} * 512;
}

int WriteText(LogFile& file, const std::string& text) {
  Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  const int result = file.Write(bytes);
  EXPECT_TRUE(result != 0 || bytes.empty());
  return result;
}

class LogFileTest : public ::testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string path_ = folder_.path() + "/a.lcm";
  LogFile file_;
};

TEST_F(LogFileTest, ReservesRoomThatReadersDoNotSeeAndGivesItBack) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one"), 0);
  ASSERT_EQ(WriteText(file_, "two"), 0);
  EXPECT_EQ(ContentOf(path_), "onetwo");
  EXPECT_GT(BytesOnDisk(path_), 1 << 20) << "this file system reserves nothing";
  EXPECT_GT(file_.FreeBytes(), 0);
  EXPECT_EQ(file_.Sync(), 0);
  EXPECT_EQ(file_.Close(), 0);
  EXPECT_FALSE(file_.is_open());
  EXPECT_EQ(ContentOf(path_), "onetwo");
  EXPECT_LE(BytesOnDisk(path_), 1 << 16);
}

TEST_F(LogFileTest, NeverReplacesAFile) {
  ASSERT_EQ(file_.Create(path_), 0);
  LogFile other;
  EXPECT_EQ(other.Create(path_), EEXIST);
  EXPECT_FALSE(other.is_open());
  EXPECT_EQ(other.Create(folder_.path() + "/none/a.lcm"), ENOENT);
}

TEST_F(LogFileTest, GoesOnBehindWhatIsKept) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one and a torn tail"), 0);
  ASSERT_EQ(file_.Close(), 0);
  LogFile again;
  ASSERT_EQ(again.Continue(path_, 3), 0);
  EXPECT_EQ(again.size(), 3);
  ASSERT_EQ(WriteText(again, "two"), 0);
  EXPECT_EQ(ContentOf(path_), "onetwo");
  ASSERT_EQ(again.CutTo(4), 0);
  EXPECT_EQ(ContentOf(path_), "onet");
}

TEST_F(LogFileTest, ReservesSixteenMegabytesBeyondTheEnd) {
  constexpr std::int64_t kReserve = 16 << 20;
  constexpr std::int64_t kTables = 1 << 16;  // of the file system
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one"), 0);
  EXPECT_GE(BytesOnDisk(path_), kReserve);
  EXPECT_LE(BytesOnDisk(path_), kReserve + kTables);
  ASSERT_EQ(WriteText(file_, std::string(kReserve, 'x')), 0);
  EXPECT_LE(BytesOnDisk(path_), kReserve + kTables) << "it was reserved";
  ASSERT_EQ(WriteText(file_, "y"), 0);
  EXPECT_GE(BytesOnDisk(path_), 2 * kReserve);
  EXPECT_LE(BytesOnDisk(path_), 2 * kReserve + kTables);
  ASSERT_EQ(file_.CutTo(4), 0);
  EXPECT_LE(BytesOnDisk(path_), kTables);
  ASSERT_EQ(WriteText(file_, "z"), 0);
  EXPECT_GE(BytesOnDisk(path_), kReserve) << "reserved again behind the cut";
}

TEST_F(LogFileTest, ALargeWriteReservesRoomBehindItsEnd) {
  constexpr std::int64_t kMegabyte = 1 << 20;
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, std::string(kMegabyte, 'x')), 0);
  EXPECT_GE(BytesOnDisk(path_), 17 * kMegabyte);
}

TEST_F(LogFileTest, AnInterruptedWriteIsRepeated) {
  ASSERT_EQ(file_.Create(path_), 0);
  FileCalls::PlantWrite(-1, EINTR);
  EXPECT_EQ(WriteText(file_, "one"), 0);
  EXPECT_EQ(ContentOf(path_), "one");
}

TEST_F(LogFileTest, ADiskThatTakesNothingIsAnError) {
  ASSERT_EQ(file_.Create(path_), 0);
  FileCalls::PlantWrite(0, EINTR);
  const std::string text = "one";
  Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  EXPECT_EQ(file_.Write(bytes), EIO);
  EXPECT_EQ(bytes.size(), 3U);
  EXPECT_EQ(file_.size(), 0);
  FileCalls::PlantWrite(-1, ENOSPC);
  EXPECT_EQ(file_.Write(bytes), ENOSPC);
  EXPECT_EQ(file_.Write(bytes), 0) << "there is room again";
  EXPECT_EQ(ContentOf(path_), "one");
}

TEST_F(LogFileTest, AFileIsWrittenByOneOnly) {
  EXPECT_FALSE(LogFile::IsBeingWritten(path_)) << "there is no file";
  ASSERT_EQ(file_.Create(path_), 0);
  EXPECT_TRUE(LogFile::IsBeingWritten(path_));
  ASSERT_EQ(WriteText(file_, "one"), 0);
  LogFile other;
  EXPECT_EQ(other.Continue(path_, 0), EBUSY);
  EXPECT_FALSE(other.is_open());
  EXPECT_EQ(ContentOf(path_), "one");
  EXPECT_EQ(other.Create(folder_.path() + "/b.lcm"), 0) << "another file is free";
  ASSERT_EQ(file_.Close(), 0);
  EXPECT_FALSE(LogFile::IsBeingWritten(path_));
  EXPECT_EQ(other.Continue(path_, 3), 0);
  EXPECT_TRUE(LogFile::IsBeingWritten(path_));
  EXPECT_FALSE(LogFile::IsBeingWritten(folder_.path() + "/b.lcm")) << "left for the first";
  EXPECT_EQ(other.Continue(folder_.path() + "/c.lcm", 0), ENOENT);
}

TEST_F(LogFileTest, ANewFileBeginsEmptyWhateverWasWrittenBefore) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "one"), 0);
  EXPECT_EQ(file_.size(), 3);
  const std::string second = folder_.path() + "/b.lcm";
  ASSERT_EQ(file_.Create(second), 0);
  EXPECT_EQ(file_.size(), 0);
  ASSERT_EQ(WriteText(file_, "2"), 0);
  EXPECT_EQ(ContentOf(second), "2");
  EXPECT_GT(BytesOnDisk(second), 1 << 20) << "it has room of its own";
  EXPECT_EQ(ContentOf(path_), "one");
}

// A name that cannot be synced is reported until it can: here its folder has another name for a while.
TEST_F(LogFileTest, ItsNameIsSyncedOnce) {
  const std::string folder = folder_.path() + "/logs";
  const std::string elsewhere = folder_.path() + "/elsewhere";
  std::filesystem::create_directory(folder);
  const auto move_away = [&] { std::filesystem::rename(folder, elsewhere); };
  const auto move_back = [&] { std::filesystem::rename(elsewhere, folder); };
  for (const bool continued : {false, true}) {
    const std::string path = folder + "/a.lcm";
    ASSERT_EQ(continued ? file_.Continue(path, 0) : file_.Create(path), 0);
    move_away();
    errno = 0;
    EXPECT_EQ(file_.Sync(), ENOENT) << continued;
    EXPECT_EQ(file_.Sync(), ENOENT) << continued;
    move_back();
    EXPECT_EQ(file_.Sync(), 0) << continued;
    move_away();
    EXPECT_EQ(file_.Sync(), 0) << "its name is on the disk";
    EXPECT_EQ(file_.Close(), 0);
    move_back();
  }
  ASSERT_EQ(file_.Create(folder + "/b.lcm"), 0);
  move_away();
  EXPECT_EQ(file_.Close(), ENOENT);
  EXPECT_FALSE(file_.is_open());
}

TEST_F(LogFileTest, WhatOneCallDoesNotTakeIsWrittenByTheNext) {
  ASSERT_EQ(file_.Create(path_), 0);
  ASSERT_EQ(WriteText(file_, "1"), 0);
  FileCalls::PlantWrite(5, EINTR);  // an errno that a call left before
  EXPECT_EQ(WriteText(file_, "0123456789"), 0);
  EXPECT_EQ(file_.size(), 11);
  EXPECT_EQ(ContentOf(path_), "10123456789");
}

TEST_F(LogFileTest, FreeBytesAreThoseOfItsDisk) {
  EXPECT_EQ(file_.FreeBytes(), -1) << "it is not open";
  ASSERT_EQ(file_.Create(path_), 0);
  const auto available = static_cast<double>(std::filesystem::space(folder_.path()).available);
  EXPECT_NEAR(static_cast<double>(file_.FreeBytes()), available, available / 4);
}

TEST(LogFile, ADeviceCannotBeSynced) {
  LogFile file;
  ASSERT_EQ(file.Continue("/dev/full", 0), EINVAL);
  EXPECT_EQ(file.Sync(), EINVAL);
  EXPECT_EQ(file.Close(), EINVAL);
}

TEST(LogFile, AFullDiskIsToldWithWhatWasWritten) {
  LogFile file;
  ASSERT_EQ(file.Continue("/dev/full", 0), EINVAL) << "a device cannot be cut";
  const std::string text = "x";
  Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  EXPECT_EQ(file.Write(bytes), ENOSPC);
  EXPECT_EQ(bytes.size(), 1U);
  EXPECT_EQ(file.size(), 0);
}

}  // namespace
}  // namespace axlecast
