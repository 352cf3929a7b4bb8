#include "bridge/store/sqlite_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using S = command_status_t;

class SqliteStoreTest : public StoreTest {
 protected:
  // No file of this process may grow beyond so many bytes: writes fail as on a full disk.
  static void LimitFiles(const std::string& bytes) {
    const std::string command = "prlimit --pid " + std::to_string(getpid()) + " --fsize=" + bytes + ":";
    ASSERT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c)
  }
  static void LiftLimit() { LimitFiles("unlimited"); }

  static void ExpectNothingDurable(SqliteStore& store) {
    EXPECT_NE(ErrorText(store.state()), "");
    EXPECT_FALSE(store.Accepted(Command(99), At(0)));
    EXPECT_FALSE(store.Apply("axis1", DatumRecord{}));
    EXPECT_FALSE(store.Apply("axis1", DatumVoided{0, ""}));
    EXPECT_FALSE(store.Apply("axis1", WritesAdded{1, 0}));
    EXPECT_FALSE(store.Apply("axis9", ReferenceChanged{true}));
    EXPECT_FALSE(store.Apply("axis9", IdentityChanged{"17"}));
    EXPECT_FALSE(store.Apply("axis1", EncoderExchanged{"", 0}));
    EXPECT_EQ(store.ReserveEpochs(0, 1), 0);
  }
};

TEST_F(SqliteStoreTest, AFileThatCannotBeMadeIsTriedAgainEvery10s) {
  std::ofstream(folder_.path() + "/state") << "a file where a folder should be";
  const auto store = OpenStore();
  EXPECT_THAT(ErrorText(store->state()), AllOf(HasSubstr(folder_.path() + "/state"), HasSubstr("Not a directory")));
  ExpectNothingDurable(*store);
  EXPECT_FALSE(store->Find(NumberedId(1)));
  EXPECT_TRUE(store->Open().empty());
  store->Tick(At(100));
  ASSERT_NE(ErrorText(store->state()), "");
  std::filesystem::remove(folder_.path() + "/state");
  store->Tick(At(109));
  EXPECT_NE(ErrorText(store->state()), "");
  store->Tick(At(110));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_TRUE(store->Accepted(Command(1), At(110)));
}

TEST_F(SqliteStoreTest, WhatMayOnlyBeReadIsStillAnswered) {
  {
    const auto store = OpenStore();
    ASSERT_TRUE(store->Accepted(Command(1), At(0)));
    ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 7}));
  }
  const std::string folder = std::filesystem::path(file_).parent_path();
  for (const std::string& path : {folder_.path(), folder_.path() + "/state", folder}) {
    ASSERT_EQ(chmod(path.c_str(), 0555), 0);
  }
  for (const char* end : {"", "-wal", "-shm"}) ASSERT_EQ(chmod((file_ + end).c_str(), 0444), 0);
  {
    const Unprivileged user;
    const auto store = OpenStore();
    EXPECT_THAT(ErrorText(store->state()), AllOf(HasSubstr(file_), HasSubstr("permission denied: let user")));
    ExpectNothingDurable(*store);
    ASSERT_TRUE(store->Find(NumberedId(1)));
    EXPECT_EQ(store->Open().size(), 1U);
    EXPECT_EQ(store->Find("axis1").datum->counts, 7);
    EXPECT_EQ(store->Datums("axis1").size(), 1U);
  }
  for (const std::string& path : {folder_.path(), folder_.path() + "/state", folder}) {
    ASSERT_EQ(chmod(path.c_str(), 0755), 0);
  }
}

TEST_F(SqliteStoreTest, OnAFullDiskOutcomesAreRememberedAndWrittenLater) {
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  ASSERT_TRUE(store->Routed(Moved(Command(1).status, S::STATE_ROUTED), 1, At(0)));
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 7}));
  LimitFiles("4096");
  EXPECT_FALSE(store->Accepted(Command(2), At(1)));
  EXPECT_THAT(ErrorText(store->state()),
              AllOf(HasSubstr(file_ + ": disk I/O error"), HasSubstr("or a quota or limit is reached")));
  ExpectNothingDurable(*store);
  store->Outcome(Moved(Command(1).status, S::STATE_SUCCEEDED, "done"), At(2));
  EXPECT_EQ(store->Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
  // Refused above; one that is done all the same, a stop, is noted when that works.
  EXPECT_FALSE(store->Find(NumberedId(2)));
  EXPECT_FALSE(store->Routed(Moved(Command(2).status, S::STATE_ROUTED), 5, At(2)));
  store->Outcome(Moved(Command(2).status, S::STATE_SUCCEEDED, "stopped"), At(3));
  store->Note({kStart, "axis1", "moved_while_off", "text"});
  store->Tick(At(3));
  EXPECT_EQ(store->Find(NumberedId(2))->text, "stopped");
  EXPECT_FALSE(store->Accepted(Command(2), At(3)));
  LiftLimit();
  EXPECT_EQ(SqliteStore(Copy(), "press3").Find(NumberedId(1))->state, S::STATE_ROUTED);
  store->Tick(At(3.9));  // within a second of the last failure
  EXPECT_NE(ErrorText(store->state()), "");
  store->Tick(At(4));
  EXPECT_EQ(ErrorText(store->state()), "");
  const SqliteStore later(Copy(), "press3");
  EXPECT_EQ(later.Find(NumberedId(1))->text, "done");
  EXPECT_EQ(later.Find(NumberedId(2))->text, "stopped");
  EXPECT_EQ(Ask("SELECT who, sent_epoch FROM commands WHERE number = 2"), "plc|5\n");
  EXPECT_EQ(Ask("SELECT count(*) FROM steps WHERE command = 2"), "3\n");
  EXPECT_EQ(Ask("SELECT count(*) FROM events"), "1\n");
  EXPECT_TRUE(store->Accepted(Command(3), At(5)));
  signal(SIGXFSZ, ignored);
}

TEST_F(SqliteStoreTest, AFullDiskThatHasRoomAgainIsNoticedWithoutACommand) {
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  const auto store = OpenStore();
  LimitFiles("1024");
  EXPECT_FALSE(store->Accepted(Command(1), At(0)));
  store->Tick(At(1));
  EXPECT_NE(ErrorText(store->state()), "");
  LiftLimit();
  store->Tick(At(2));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_TRUE(store->Accepted(Command(1), At(2)));
  signal(SIGXFSZ, ignored);
}

TEST_F(SqliteStoreTest, WhatPilesUpIsWrittenInPortions) {
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  auto store = OpenStore();
  LimitFiles("1024");
  const auto count = static_cast<std::uint32_t>(SqliteJournal::kBatch + 50);
  for (std::uint32_t number = 1; number <= count; ++number) {
    EXPECT_FALSE(store->Accepted(Command(number), At(0)));
    store->Outcome(Moved(Command(number).status, S::STATE_SUCCEEDED), At(0));
  }
  LiftLimit();
  store->Tick(At(1));
  EXPECT_EQ(Ask("SELECT count(*) FROM commands"), std::to_string(SqliteJournal::kBatch) + "\n");
  for (std::uint32_t number = 1; number <= count; ++number) ASSERT_TRUE(store->Find(NumberedId(number)));
  store->Tick(At(1.1));
  EXPECT_EQ(Ask("SELECT count(*) FROM commands"), std::to_string(count) + "\n");
  EXPECT_EQ(Ask("SELECT count(*) FROM steps"), std::to_string(2 * count) + "\n");
  signal(SIGXFSZ, ignored);
}

TEST_F(SqliteStoreTest, ADamagedFileIsRefusedUntilItIsMovedAway) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  std::filesystem::resize_file(file_, 5000);
  std::filesystem::remove(file_ + "-wal");
  const auto store = OpenStore();
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("it is damaged: move it away, with -wal and -shm"));
  ExpectNothingDurable(*store);
  store->Tick(At(20));
  EXPECT_NE(ErrorText(store->state()), "");
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file_ + end);
  store->Tick(At(30));
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("is missing or empty, but"));
  std::filesystem::remove(file_ + "-guard");
  store->Tick(At(40));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_TRUE(store->Accepted(Command(1), At(40)));
}

TEST_F(SqliteStoreTest, FilesOfOthersAreRefused) {
  const auto error = [this] { return ErrorText(OpenStore()->state()); };
  { ASSERT_EQ(error(), ""); }
  EXPECT_THAT(ErrorText(SqliteStore(file_, "press4").state()),
              HasSubstr("is the journal of machine 'press3', not of 'press4'"));
  ASSERT_EQ(Ask("UPDATE meta SET value = 2 WHERE key = 'schema_version'"), "");
  EXPECT_THAT(error(), HasSubstr("was written by a newer axlecast (its version is 2, this program knows 1)"));
  ExpectNothingDurable(*OpenStore());
  for (const char* end : {"", "-wal", "-shm", "-guard"}) std::filesystem::remove(file_ + end);
  ASSERT_EQ(Ask("CREATE TABLE songs (title)"), "");
  std::filesystem::permissions(file_, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_THAT(error(), HasSubstr("is no journal of axlecast"));
  EXPECT_EQ(Ask("SELECT name FROM sqlite_schema"), "songs\n") << "nothing was added to it";
}

TEST_F(SqliteStoreTest, TheJournalOfAnotherMachineIsNotRead) {
  { ASSERT_TRUE(OpenStore()->Apply("axis1", DatumRecord{.counts = 7})); }
  const SqliteStore other(file_, "press4");
  EXPECT_FALSE(other.readable());
  EXPECT_FALSE(other.Find("axis1").datum);
  EXPECT_TRUE(other.Datums("axis1").empty());
  EXPECT_TRUE(other.Marks("axis1").empty());
}

TEST_F(SqliteStoreTest, WhatChangesNothingIsNotDurableEither) {
  std::ofstream(folder_.path() + "/state") << "a file where a folder should be";
  const auto store = OpenStore();
  EXPECT_FALSE(store->Apply("axis1", ReferenceChanged{false}));
  std::filesystem::remove(folder_.path() + "/state");
  store->Tick(At(10));
  EXPECT_TRUE(store->Apply("axis1", ReferenceChanged{false}));
  EXPECT_EQ(Ask("SELECT count(*) FROM axes"), "0\n") << "which needs no row";
}

TEST_F(SqliteStoreTest, AFileThatAnotherProgramChangedIsReadAgain) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  ASSERT_EQ(Ask("UPDATE meta SET value = value + 1 WHERE key = 'changes'"), "");
  EXPECT_FALSE(store->Accepted(Command(2), At(1)));
  EXPECT_EQ(ErrorText(store->state()), file_ + " was changed by another program: stop the other program");
  EXPECT_FALSE(store->readable());
  store->Tick(At(20));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_TRUE(store->Accepted(Command(2), At(20)));
}

TEST_F(SqliteStoreTest, ATickThatHasNothingToWriteWritesNothing) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  for (const double seconds : {1, 5, 20}) store->Tick(At(seconds));
  EXPECT_EQ(Ask("SELECT value FROM meta WHERE key = 'changes'"), "1\n");
}

TEST_F(SqliteStoreTest, ADiskThatFailsIsNotTakenForAnotherProgram) {
  const auto store = OpenStore();
  ASSERT_EQ(Ask("CREATE TRIGGER fails BEFORE INSERT ON meta BEGIN SELECT RAISE(ABORT, 'planted'); END"), "");
  EXPECT_FALSE(store->Accepted(Command(1), At(0)));
  EXPECT_EQ(ErrorText(store->state()), file_ + ": planted");
  EXPECT_TRUE(store->readable());
  ASSERT_EQ(Ask("DROP TRIGGER fails"), "");
  EXPECT_TRUE(store->Accepted(Command(1), At(1)));
}

// Its pages are damaged while the bridge runs. Another program has caused that they are read again.
TEST_F(SqliteStoreTest, DamageThatIsFoundLaterEndsTheUseOfTheFile) {
  for (const bool by_commit : {false, true}) {
    for (const char* end : {"", "-wal", "-shm", "-guard"}) std::filesystem::remove(file_ + end);
    const auto store = OpenStore();
    ASSERT_TRUE(store->Accepted(Command(1), At(0)));
    ASSERT_EQ(Ask("CREATE TABLE other (x); PRAGMA wal_checkpoint(TRUNCATE)"), "0|0|0\n");
    std::fstream file(file_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(4096) << std::string(std::filesystem::file_size(file_) - 4096, '\xA5');
    file.close();
    if (by_commit) {
      EXPECT_FALSE(store->Apply("axis1", ReferenceChanged{true}));
    } else {
      EXPECT_FALSE(store->Find(NumberedId(1)));
      EXPECT_TRUE(store->readable());
      store->Tick(At(1));
    }
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("it is damaged: move it away")) << by_commit;
    EXPECT_FALSE(store->readable());
    EXPECT_TRUE(store->Open().empty());
  }
}

TEST_F(SqliteStoreTest, ALockByAnotherProgramDelaysAndLosesNothing) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  const auto opened = Database::Open(file_, Database::Access::kReadWrite);
  ASSERT_TRUE(opened) << opened.error().text;
  const auto& other = *opened;
  ASSERT_TRUE(other->Execute("BEGIN IMMEDIATE"));
  store->Outcome(Moved(Command(1).status, S::STATE_SUCCEEDED), At(1));
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("another program keeps it locked"));
  EXPECT_EQ(store->Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
  ASSERT_TRUE(other->Execute("ROLLBACK"));
  store->Tick(At(2));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_EQ(OpenStore()->Find(NumberedId(1))->state, S::STATE_SUCCEEDED);
}

// Commits commands and writes the number of each to the pipe, until it is killed.
[[noreturn]] void WriteForEver(const std::string& file, int pipe, CommandRecord (*command)(std::uint32_t)) {
  SqliteStore store(file, "press3");
  for (std::uint32_t number = 1;; ++number) {
    CommandRecord record = command(number);
    if (!store.Accepted(record, {}) || !store.Routed(record.status, number, {})) _exit(1);
    record.status.state = S::STATE_SUCCEEDED;
    record.status.is_final = 1;
    store.Outcome(record.status, {});
    if (!store.Apply("axis1", DatumRecord{.counts = number})) _exit(1);
    if (write(pipe, &number, sizeof number) != sizeof number) _exit(1);
  }
}

TEST_F(SqliteStoreTest, WhatItAnsweredIsThereAfterKill9) {
  std::uint32_t told = 0;
  for (std::uint32_t more = 1; more < 60; more += 19) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const std::string file = folder_.path() + "/" + std::to_string(more) + "/journal.db";
    const pid_t child = fork();
    if (child == 0) WriteForEver(file, ends[1], [](std::uint32_t number) { return Command(number); });
    ASSERT_GT(child, 0);
    close(ends[1]);
    std::uint32_t number = 0;
    while (number < more && read(ends[0], &number, sizeof number) == sizeof number) told = number;
    ASSERT_EQ(kill(child, SIGKILL), 0);
    while (read(ends[0], &number, sizeof number) == sizeof number) told = number;
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    close(ends[0]);
    ASSERT_GE(told, more);
    const SqliteStore store(file, "press3");
    ASSERT_EQ(ErrorText(store.state()), "");
    for (number = 1; number <= told; ++number) {
      ASSERT_TRUE(store.Find(NumberedId(number)));
      ASSERT_EQ(store.Find(NumberedId(number))->state, S::STATE_SUCCEEDED);
    }
    EXPECT_GE(store.Find("axis1").datum->counts, told);
    EXPECT_LE(store.Open().size(), 1U);
    EXPECT_EQ(Ask(file, "PRAGMA integrity_check"), "ok\n");
  }
}

}  // namespace
}  // namespace axlecast
