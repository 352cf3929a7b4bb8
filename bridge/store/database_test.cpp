#include "bridge/store/database.h"

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "bridge/store/store_fixture.h"
#include "core/messages/enum_names.h"
#include "tests/disk/file_calls.h"

namespace axlecast {
namespace {

using Access = Database::Access;
using ::testing::HasSubstr;
using ::testing::Not;
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
  static std::string Content(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  // Of this process.
  static std::ptrdiff_t OpenFiles() {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
  }
  void MakeFile() const {
    std::filesystem::create_directories(std::filesystem::path(file_).parent_path());
    std::ofstream(file_) << "";
    std::filesystem::permissions(file_, std::filesystem::perms{0640});
  }
  static mode_t Mode(const std::string& path) {
    struct stat status {};
    return stat(path.c_str(), &status) == 0 ? status.st_mode & 07777 : 0;
  }

  const TemporaryFolder folder_;
  const std::string file_ = folder_.path() + "/a/b/it's 100%41?#.db";
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

TEST_F(DatabaseTest, AJournalThatSomebodyElseWroteHasNoPower) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  EXPECT_EQ(Number(*database, "PRAGMA trusted_schema"), 0);
  EXPECT_EQ(Number(*database, "PRAGMA busy_timeout"), 100);
  EXPECT_EQ(Number(*database, "PRAGMA journal_size_limit"), 16 << 20);
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  ASSERT_TRUE(database->Execute("PRAGMA writable_schema = 1"));
  EXPECT_FALSE(database->Execute("DELETE FROM sqlite_schema"))
      << "https://sqlite.org/c3ref/c_dbconfig_defensive.html";
}

TEST_F(DatabaseTest, ClosesItsFiles) {
  const std::ptrdiff_t before = OpenFiles();
  {
    const auto database = Open();
    ASSERT_TRUE(database) << error_;
    ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
    EXPECT_EQ(Number(*database, "SELECT count(*) FROM t"), 0);
    EXPECT_GT(OpenFiles(), before);
  }
  EXPECT_EQ(OpenFiles(), before);
}

TEST_F(DatabaseTest, ABoundValueDoesNotStayForTheNextTime) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  for (const auto& value : {std::optional<std::int64_t>(7), std::optional<std::int64_t>()}) {
    ASSERT_TRUE(database->Execute("INSERT INTO t VALUES (?)", {OrNull(value)}));
    EXPECT_EQ(database->changed_rows(), 1);
  }
  Rows rows = database->Select("SELECT x FROM t ORDER BY rowid");
  ASSERT_TRUE(rows.Next());
  EXPECT_EQ(rows.Integer(0), 7);
  ASSERT_TRUE(rows.Next());
  EXPECT_TRUE(rows.IsNull(0));
}

TEST_F(DatabaseTest, MoreValuesThanPlacesAreAnError) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x)"));
  EXPECT_FALSE(database->Execute("INSERT INTO t VALUES (?)", {std::int64_t{1}, std::int64_t{2}}));
  EXPECT_THAT(ErrorText(database->result()), HasSubstr("column index out of range"));
  EXPECT_FALSE(database->Select("SELECT x FROM t WHERE x = ?", {std::int64_t{1}, std::int64_t{2}}).Next());
  EXPECT_EQ(Number(*database, "SELECT count(*) FROM t"), 0);
}

TEST_F(DatabaseTest, AStatementThatAnswersRowsIsExecutedToo) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  EXPECT_TRUE(database->Execute("PRAGMA user_version"));
  EXPECT_EQ(ErrorText(database->result()), "");
}

TEST_F(DatabaseTest, RowsThatAreDroppedBeforeTheirEndKeepNothingLocked) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t AS SELECT 7 AS x UNION SELECT 8"));
  {
    Rows rows = database->Select("SELECT x FROM t");
    ASSERT_TRUE(rows.Next());
    EXPECT_FALSE(database->Execute("DROP TABLE t"));
    EXPECT_THAT(ErrorText(database->result()), HasSubstr("another program keeps it locked: end its transaction"));
    const Rows moved = std::move(rows);
    EXPECT_EQ(moved.Integer(0), 7);
  }
  EXPECT_TRUE(database->Execute("DROP TABLE t")) << ErrorText(database->result());
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
  EXPECT_EQ(rows.Text(4), "");
  EXPECT_EQ(rows.Integer(4), 0);
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

TEST_F(DatabaseTest, ATransactionThatCannotBeEndedReportsItsFirstFailure) {
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x UNIQUE)"));
  EXPECT_FALSE(database->Transact([&] {
    return database->Execute("INSERT INTO t VALUES (1)") &&
           database->Execute("INSERT OR ROLLBACK INTO t VALUES (1)");
  }));
  EXPECT_THAT(ErrorText(database->result()), HasSubstr("UNIQUE")) << "not that there is nothing to roll back";
  EXPECT_TRUE(database->Transact([] { return true; }));
  EXPECT_EQ(ErrorText(database->result()), "") << "of the last transaction";
}

TEST_F(DatabaseTest, AFailureOfTheSystemIsNotTakenForThatOfALaterStatement) {
  const auto database = Open();
  const auto other = Open();
  ASSERT_TRUE(database && other) << error_;
  ASSERT_TRUE(database->Execute("CREATE TABLE t (x UNIQUE)"));
  ASSERT_TRUE(other->Execute("INSERT INTO t VALUES (1)"));
  FileCalls::PlantFailure("pread", file_ + "-wal", ESTALE);
  EXPECT_EQ(Number(*database, "SELECT count(*) FROM t"), -1);
  EXPECT_THAT(ErrorText(database->result()),
              StartsWith(file_ + ": Stale file handle; its disk fails, can only be read"));
  EXPECT_FALSE(database->Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(ErrorText(database->result()), file_ + ": UNIQUE constraint failed: t.x");
}

TEST_F(DatabaseTest, EachErrorOfTheSystemIsToldWithItsRemedy) {
  MakeFile();
  const std::pair<int, std::string> remedies[] = {
      {ENOSPC, "no room for it: make room on its disk (df " + file_ + "), or lift the limit"},
      {EDQUOT, "no room for it: make room on its disk (df " + file_ + "), or lift the limit"},
      {EFBIG, "no room for it: make room on its disk (df " + file_ + "), or lift the limit"},
      {EROFS, "it can only be read: mount its disk writable, or let this user write the file and its folder"},
      {EACCES, "permission denied: let user " + std::to_string(geteuid()) + " write the file and its folder"},
      {EPERM, "permission denied: let user " + std::to_string(geteuid()) + " write the file and its folder"},
  };
  for (const auto& [error, remedy] : remedies) {
    for (const char* call : {"open", "fstat"}) {
      FileCalls::PlantFailure(call, file_, error);
      EXPECT_FALSE(Open(Access::kReadOnly));
      EXPECT_EQ(error_, file_ + ": " + std::strerror(error) + "; " + remedy) << call;
    }
  }
  FileCalls::PlantFailure("open", file_, EMFILE);
  EXPECT_FALSE(Open(Access::kReadOnly));
  EXPECT_EQ(error_, file_ + ": Too many open files") << "which needs no remedy of the file";
  FileCalls::PlantFailure("fcntl", file_, EPERM);
  EXPECT_FALSE(Open(Access::kReadOnly));
  EXPECT_EQ(error_, file_ + ": access permission denied; permission denied: let user " + std::to_string(geteuid()) +
                        " write the file and its folder");
}

// SQLite takes 512 bytes at most.
TEST_F(DatabaseTest, APathThatSqliteCannotOpenIsAnError) {
  const std::string file =
      folder_.path() + "/" + std::string(250, 'a') + "/" + std::string(250, 'b') + "/journal.db";
  EXPECT_FALSE(Open(file, Access::kReadWrite));
  EXPECT_THAT(error_, StartsWith(file + ": "));
  EXPECT_THAT(error_, Not(HasSubstr("not an error")));
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
  EXPECT_THAT(ErrorText(reader->result()), HasSubstr("; it can only be read: mount its disk writable"));
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 0);
  ASSERT_TRUE(writer->Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, AReaderLeavesWhatACrashHasLeft) {
  const auto writer = Open();
  ASSERT_TRUE(writer) << error_;
  ASSERT_TRUE(writer->Execute("CREATE TABLE t AS SELECT 7 AS x"));
  const std::string copy = folder_.path() + "/copy.db";
  for (const char* end : {"", "-wal"}) std::ofstream(copy + end) << Content(file_ + end);
  const std::string before = Content(copy);
  const std::string log = Content(copy + "-wal");
  ASSERT_NE(log, "");
  {
    const auto reader = Open(copy, Access::kReadOnly);
    ASSERT_TRUE(reader) << error_;
    EXPECT_EQ(Number(*reader, "SELECT x FROM t"), 7);
  }
  EXPECT_EQ(Content(copy), before);
  EXPECT_EQ(Content(copy + "-wal"), log);
}

TEST_F(DatabaseTest, AReaderWithoutALogSeesWhatIsWrittenLater) {
  ASSERT_TRUE(Open()->Execute("CREATE TABLE t (x)"));
  std::filesystem::remove(file_ + "-wal");
  std::filesystem::remove(file_ + "-shm");
  const auto reader = Open(Access::kReadOnly);
  ASSERT_TRUE(reader) << error_;
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 0);
  const auto writer = Open();
  ASSERT_TRUE(writer) << error_;
  ASSERT_TRUE(writer->Execute("INSERT INTO t VALUES (1)"));
  EXPECT_EQ(Number(*reader, "SELECT count(*) FROM t"), 1);
}

TEST_F(DatabaseTest, AReaderThatMayNotWriteSeesWhatTheBridgeWritesNow) {
  const auto writer = Open();
  ASSERT_TRUE(writer) << error_;
  ASSERT_TRUE(writer->Execute("CREATE TABLE t AS SELECT 7 AS x"));
  const std::string folder = std::filesystem::path(file_).parent_path();
  for (const std::string& path : {folder_.path(), folder_.path() + "/a"}) ASSERT_EQ(chmod(path.c_str(), 0755), 0);
  ASSERT_EQ(chmod(folder.c_str(), 0555), 0);
  for (const char* end : {"", "-wal", "-shm"}) ASSERT_EQ(chmod((file_ + end).c_str(), 0444), 0);
  {
    const Unprivileged user;
    const auto reader = Open(Access::kReadOnly);
    ASSERT_TRUE(reader) << error_;
    EXPECT_EQ(Number(*reader, "SELECT x FROM t"), 7) << "which is in the log only";
  }
  ASSERT_EQ(chmod(folder.c_str(), 0755), 0);
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
  for (const Access access : {Access::kReadWrite, Access::kReadOnly}) {
    EXPECT_FALSE(Open(access)) << "and waits for no other end of a FIFO";
    EXPECT_THAT(error_, HasSubstr("is no regular file"));
  }
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

TEST_F(DatabaseTest, DamageThatIsFoundLaterIsLost) {
  const std::pair<std::streamoff, std::string> places[] = {{0, "it is no SQLite database: move it away"},
                                                           {4096, "it is damaged: move it away, with -wal"}};
  for (const auto& [place, remedy] : places) {
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file_ + end);
    const auto database = Open();
    const auto other = Open();  // so that the pages are read again
    ASSERT_TRUE(database && other) << error_;
    ASSERT_TRUE(database->Execute("CREATE TABLE t AS SELECT 7 AS x"));
    ASSERT_TRUE(other->Execute("CREATE TABLE u (x)"));
    ASSERT_TRUE(other->Execute("PRAGMA wal_checkpoint(TRUNCATE)"));
    std::fstream(file_, std::ios::in | std::ios::out | std::ios::binary).seekp(place) << std::string(4096, '\xA5');
    EXPECT_EQ(Number(*database, "SELECT x FROM t"), -1);
    EXPECT_THAT(ErrorText(database->result()), HasSubstr(remedy));
    EXPECT_TRUE(database->lost()) << remedy;
    static_cast<void>(database->Transact([] { return false; }));
    EXPECT_EQ(database->lost(), place == 0) << "of the last transaction";
  }
}

TEST_F(DatabaseTest, WhatIsNoDatabaseIsLost) {
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path());
  std::ofstream(file_) << std::string(8192, 'x');
  for (const Access access : {Access::kReadWrite, Access::kReadOnly}) {
    EXPECT_FALSE(Open(access));
    EXPECT_THAT(error_, HasSubstr("it is no SQLite database: move it away"));
  }
}

TEST_F(DatabaseTest, AnIndexThatIsALinkIsAnError) {
  MakeFile();
  std::filesystem::create_symlink("other", file_ + "-shm");
  const auto database = Open();
  ASSERT_TRUE(database) << error_;
  EXPECT_FALSE(database->Execute("CREATE TABLE t (x)"));
  EXPECT_EQ(ErrorText(database->result()), file_ + ": Too many levels of symbolic links");
}

TEST_F(DatabaseTest, AFileThatIsLockedWhileItIsOpenedIsAnError) {
  const auto other = Open();
  ASSERT_TRUE(other) << error_;
  ASSERT_TRUE(other->Execute("CREATE TABLE t (x)"));
  ASSERT_TRUE(other->Execute("PRAGMA journal_mode = DELETE"));
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE"));
  EXPECT_FALSE(Open());
  EXPECT_THAT(error_, HasSubstr("another program keeps it locked"));
  ASSERT_TRUE(other->Execute("ROLLBACK"));
  EXPECT_TRUE(Open());
}

// ---- the tables ----

class SchemaTest : public DatabaseTest {
 protected:
  std::string Prepare() {
    const auto database = Open();
    return database ? ErrorText(PrepareSchema(*database, file_, "press3")) : error_;
  }
  std::string Check(const std::string& machine) {
    const auto database = Open(Access::kReadOnly);
    return database ? ErrorText(CheckSchema(*database, file_, machine)) : error_;
  }
  void Execute(const char* sql) {
    const auto database = Open();
    ASSERT_TRUE(database) << error_;
    ASSERT_TRUE(database->Execute(sql)) << ErrorText(database->result());
  }
};

TEST_F(SchemaTest, EveryNumberHasItsWord) {
  ASSERT_EQ(Prepare(), "");
  const auto database = Open();
  const auto expect = [&](std::string_view kind, auto name, int known) {
    Rows rows = database->Select("SELECT number, word FROM words WHERE kind = ? ORDER BY number", {kind});
    for (int number = 0; number < known; ++number) {
      ASSERT_TRUE(rows.Next()) << kind << number;
      EXPECT_EQ(rows.Integer(0), number);
      EXPECT_EQ(rows.Text(1), name(number));
    }
    EXPECT_FALSE(rows.Next());
    EXPECT_EQ(name(known), "unknown");
  };
  using S = command_status_t;
  expect(
      "state", [](int number) { return StateName(static_cast<std::int8_t>(number)); }, S::STATE_INDETERMINATE + 1);
  expect(
      "finding", [](int number) { return FindingName(static_cast<std::int8_t>(number)); },
      S::FINDING_CANNOT_TELL + 1);
  int reasons = 1;
  while (ReasonName(reasons) != "unknown") ++reasons;
  expect(
      "reason", [](int number) { return ReasonName(number); }, reasons);
}

TEST_F(SchemaTest, ATableThatCannotBeMadeLeavesNothing) {
  for (const std::string view : {"meta", "words", "axes", "history"}) {
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file_ + end);
    Execute(("CREATE VIEW " + view + " AS SELECT 7 AS x").c_str());
    EXPECT_THAT(Prepare(), HasSubstr(view)) << "its name is taken";
    const auto database = Open();
    EXPECT_EQ(Number(*database, "SELECT count(*) FROM sqlite_schema"), 1) << view;
  }
}

TEST_F(SchemaTest, ADiskThatIsFullLeavesNothing) {
  bool made = false;
  for (int pages = 2; !made; ++pages) {
    const auto database = Open();
    ASSERT_TRUE(database) << error_;
    ASSERT_TRUE(database->Execute("PRAGMA max_page_count = " + std::to_string(pages)));
    const Result<> prepared = PrepareSchema(*database, file_, "press3");
    made = prepared.has_value();
    if (made) break;
    EXPECT_THAT(ErrorText(prepared), HasSubstr("no room for it")) << pages;
    EXPECT_EQ(Number(*database, "SELECT count(*) FROM sqlite_schema"), 0) << pages;
    ASSERT_LT(pages, 100);
  }
  EXPECT_EQ(Check("press3"), "");
}

TEST_F(SchemaTest, ATableThatCannotBeCompletedIsAnError) {
  ASSERT_EQ(Prepare(), "");
  for (const std::string kind : {"state", "finding", "reason"}) {
    Execute(("CREATE TRIGGER fails BEFORE INSERT ON words WHEN new.kind = '" + kind +
             "' BEGIN SELECT RAISE(ABORT, 'planted'); END")
                .c_str());
    EXPECT_EQ(Prepare(), file_ + ": planted") << kind;
    Execute("DROP TRIGGER fails");
  }
  Execute("DROP TABLE alarm_marks");
  Execute("CREATE INDEX alarm_marks ON events (utime)");
  EXPECT_THAT(Prepare(), HasSubstr("there is already an index named alarm_marks"));
  Execute("DROP TABLE words");
  EXPECT_THAT(Prepare(), HasSubstr("alarm_marks"));
}

TEST_F(SchemaTest, ATableOfAnotherProgramIsNoJournal) {
  Execute("CREATE TABLE meta (title)");
  EXPECT_THAT(Prepare(), HasSubstr("no such column: value"));
  EXPECT_THAT(Check(""), HasSubstr("no such column: value"));
  Execute("DROP TABLE meta");
  Execute("CREATE TABLE meta (key, value)");
  EXPECT_EQ(Prepare(), file_ + " is no journal of axlecast: name another file (bridge: journal)");
  EXPECT_EQ(Check(""), file_ + " is no journal of axlecast: name another file (bridge: journal)");
}

TEST_F(SchemaTest, IsOfOneMachineAndAReaderTakesAny) {
  ASSERT_EQ(Prepare(), "");
  EXPECT_EQ(Check("press3"), "");
  EXPECT_EQ(Check(""), "");
  EXPECT_EQ(Check("press4"), file_ +
                                 " is the journal of machine 'press3', not of 'press4': name another file (bridge: "
                                 "journal)");
}

TEST_F(SchemaTest, ADiskThatCannotBeReadIsAnErrorAndNoEmptyFile) {
  ASSERT_EQ(Prepare(), "");
  const auto database = Open();
  const auto other = Open();
  ASSERT_TRUE(database && other) << error_;
  for (const auto& check : {PrepareSchema, CheckSchema}) {
    for (const char* end : {"", "-wal"}) {  // of the schema, and of a table that was changed
      ASSERT_TRUE(other->Execute("INSERT INTO words (kind, number, word) VALUES ('test', random(), 'test')"));
      ASSERT_TRUE(other->Execute("INSERT OR REPLACE INTO meta (key, value) VALUES ('probe', 0)"));
      FileCalls::PlantFailure("pread", file_ + end, ESTALE);
      EXPECT_THAT(ErrorText(check(*database, file_, "press3")), HasSubstr("Stale file handle")) << end;
    }
  }
}

}  // namespace

}  // namespace axlecast
