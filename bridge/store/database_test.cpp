#include "bridge/store/database.h"

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <filesystem>
#include <fstream>

#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using Access = Database::Access;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class DatabaseTest : public ::testing::Test {
 protected:
  std::unique_ptr<Database> Open(Access access = Access::kReadWrite) { return Open(file_, access); }
  // Returns null after an error, which is then in error_.
  std::unique_ptr<Database> Open(const std::string& file, Access access) {
    auto opened = Database::Open(file, access);
    error_ = ErrorText(opened);
    return opened ? std::move(*opened) : nullptr;
  }

  static std::int64_t Number(Database& database, const char* sql) {
    Rows rows = database.Select(sql);
    return rows.Next() ? rows.Integer(0) : -1;
  }
  static mode_t Mode(const std::string& path) {
    struct stat status {};
    return stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : 0;
  }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.path() + "/a/b/it's 100%?#.db";
  std::string error_;
};

TEST_F(DatabaseTest, MakesFoldersAndFileForOwnerAndGroup) {
  const mode_t mask = umask(022);
  const auto database = Open();
  umask(mask);
  ASSERT_TRUE(database) << error_;
  EXPECT_EQ(Mode(folder_.path() + "/a"), 0750U);
  EXPECT_EQ(Mode(folder_.path() + "/a/b"), 0750U);
  EXPECT_EQ(Mode(file_), 0640U);
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  EXPECT_EQ(Mode(file_ + "-wal"), 0640U);
}

TEST_F(DatabaseTest, ACommitIsOnTheDisk) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  EXPECT_EQ(Number(*database, "PRAGMA synchronous"), 2);  // https://sqlite.org/pragma.html#pragma_synchronous: FULL
  EXPECT_EQ(Number(*database, "PRAGMA foreign_keys"), 1);
  Rows rows = database->Select("PRAGMA journal_mode");
  ASSERT_TRUE(rows.Next());
  EXPECT_EQ(rows.Text(0), "wal");
}

TEST_F(DatabaseTest, KeepsEveryKindOfValue) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (a, b, c, d, e)"));
  const std::string zero("a\0b", 3);
  ASSERT_TRUE(database->Execute("INSERT INTO t VALUES (?, ?, ?, ?, ?)",
                                {INT64_MIN, 0.1, zero, std::string_view(), OrNull(std::nullopt)}));
  EXPECT_EQ(database->inserted_number(), 1);
  Rows rows = database->Select("SELECT a, b, c, d, e FROM t");
  ASSERT_TRUE(rows.Next());
  EXPECT_EQ(rows.Integer(0), INT64_MIN);
  EXPECT_EQ(rows.Real(1), 0.1);
  EXPECT_EQ(rows.Text(2), zero);
  EXPECT_EQ(rows.Text(3), "");
  EXPECT_FALSE(rows.IsNull(3));
  EXPECT_TRUE(rows.IsNull(4));
  EXPECT_FALSE(rows.Next());
  EXPECT_FALSE(rows.Next());
}

TEST_F(DatabaseTest, ATransactionIsAllOrNothing) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x UNIQUE)"));
  EXPECT_FALSE(database->Transact([&] {
    return database->Execute("INSERT INTO t VALUES (1)") && database->Execute("INSERT INTO t VALUES (1)");
  }));
  EXPECT_THAT(ErrorText(database->result()), HasSubstr("UNIQUE"));
  EXPECT_FALSE(database->Transact([&] { return database->Execute("INSERT INTO t VALUES (1)") && false; }));
  EXPECT_EQ(Number(*database, "SELECT count(*) FROM t"), 0);
  EXPECT_TRUE(database->Transact([&] { return database->Execute("INSERT INTO t VALUES (1)"); }));
  EXPECT_EQ(Number(*database, "SELECT count(*) FROM t"), 1);
  EXPECT_FALSE(database->lost());
}

TEST_F(DatabaseTest, AFullDiskIsToldWithItsRemedy) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  ASSERT_TRUE(database->Execute("PRAGMA max_page_count = 4"));
  EXPECT_FALSE(database->Execute("INSERT INTO t VALUES (zeroblob(100000))"));
  EXPECT_THAT(ErrorText(database->result()),
              StartsWith(file_ + ": database or disk is full; no room for it: make room"));
  EXPECT_FALSE(database->lost());
  EXPECT_TRUE(database->Execute("INSERT INTO t VALUES (1)"));
}

TEST_F(DatabaseTest, ALockIsToldWithItsRemedy) {
  const auto database = Open();
  const auto other = Open();
  ASSERT_TRUE(database && other) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE"));
  EXPECT_FALSE(database->Transact([&] { return database->Execute("INSERT INTO t VALUES (1)"); }));
  EXPECT_THAT(ErrorText(database->result()), HasSubstr("another program keeps it locked"));
  ASSERT_TRUE(other->Execute("ROLLBACK"));
  EXPECT_TRUE(database->Transact([&] { return database->Execute("INSERT INTO t VALUES (1)"); }));
}

TEST_F(DatabaseTest, AReaderChangesNothing) {
  const auto writer = Open();
  ASSERT_TRUE(writer) << error_;
  ASSERT_TRUE(writer->Execute("CREATE TABLE t (x)"));
  const auto reader = Open(Access::kReadOnly);
  ASSERT_TRUE(reader) << error_;
  EXPECT_FALSE(reader->Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 0);
  ASSERT_TRUE(writer->Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, ReadsWhereItMayNotWrite) {
  {
    const auto writer = Open();
    ASSERT_TRUE(writer) << error_;
    ASSERT_TRUE(writer->Execute("CREATE TABLE t AS SELECT 7 AS x"));
  }
  for (const std::string& folder : {folder_.path(), folder_.path() + "/a", folder_.path() + "/a/b"}) {
    ASSERT_EQ(chmod(folder.c_str(), 0555), 0);
  }
  for (const char* end : {"", "-wal", "-shm"}) ASSERT_EQ(chmod((file_ + end).c_str(), 0444), 0);
  for (const bool copy : {false, true}) {  // with -wal and -shm as the bridge leaves them; the file alone
    const Unprivileged user;
    const auto reader = Open(Access::kReadOnly);
    ASSERT_TRUE(reader) << error_;
    EXPECT_EQ(Number(*reader, "SELECT x FROM t"), 7) << copy;
    EXPECT_FALSE(Open());
    EXPECT_THAT(error_, HasSubstr("permission denied: let user"));
    if (copy) break;
    ASSERT_EQ(geteuid() == 65534 ? seteuid(0) : 0, 0);
    ASSERT_EQ(chmod((folder_.path() + "/a/b").c_str(), 0755), 0);
    std::filesystem::remove(file_ + "-wal");
    std::filesystem::remove(file_ + "-shm");
    ASSERT_EQ(chmod((folder_.path() + "/a/b").c_str(), 0555), 0);
  }
  for (const std::string& folder : {folder_.path(), folder_.path() + "/a", folder_.path() + "/a/b"}) {
    ASSERT_EQ(chmod(folder.c_str(), 0755), 0);
  }
}

TEST_F(DatabaseTest, RefusesWhatIsNoSuchFile) {
  EXPECT_FALSE(Open(Access::kReadOnly));
  EXPECT_EQ(error_, file_ + ": No such file or directory");
  std::filesystem::create_directories(file_);
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, StartsWith(file_));
  std::filesystem::remove(file_);
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, HasSubstr("is no regular file"));
  EXPECT_FALSE(Open("/proc/nothing/journal.db", Access::kReadWrite));
  EXPECT_THAT(error_, StartsWith("/proc/nothing: No such file or directory"));
  std::filesystem::remove(file_);
  std::ofstream(file_) << "";
  ASSERT_EQ(chmod(file_.c_str(), 0666), 0);
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, HasSubstr("can be written by everybody: chmod 640"));
}

// Who owns the link decides what the bridge writes to.
TEST_F(DatabaseTest, RefusesALinkOfAnotherUser) {
  std::filesystem::create_directories(folder_.path() + "/real");
  std::filesystem::create_symlink("real", folder_.path() + "/a");
  if (geteuid() != 0) return;  // has no other users
  ASSERT_EQ(lchown((folder_.path() + "/a").c_str(), 12'345, 12'345), 0);
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, StartsWith(folder_.path() + "/a is a symbolic link of user 12345"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path() + "/real"));
}

TEST_F(DatabaseTest, WhatIsNoDatabaseIsLost) {
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path());
  std::ofstream(file_) << std::string(8192, 'x');
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, HasSubstr("it is no SQLite database: move it away"));
}

}  // namespace

}  // namespace axlecast
