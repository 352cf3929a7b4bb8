#include "bridge/store/sqlite_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <filesystem>

#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class JournalGuardTest : public StoreTest {
 protected:
  void Move(const std::string& from, const std::string& to) const {
    for (const char* end : {"", "-wal", "-shm"}) {
      if (std::filesystem::exists(from + end)) std::filesystem::rename(from + end, to + end);
    }
  }
  void Remove() const {
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file_ + end);
  }
};

TEST_F(JournalGuardTest, AFileThatIsDeletedUnderARunningBridgeIsNotReplacedByAnEmptyOne) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  Move(file_, file_ + ".away");
  EXPECT_FALSE(store->Accepted(Command(2), At(1))) << "not from the next write on";
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("was deleted, moved or replaced while the bridge used it"));
  EXPECT_FALSE(store->readable());
  store->Tick(At(20));
  EXPECT_NE(ErrorText(store->state()), "");
  EXPECT_FALSE(std::filesystem::exists(file_));
  Move(file_ + ".away", file_);
  store->Tick(At(30));
  EXPECT_EQ(ErrorText(store->state()), "");
  EXPECT_TRUE(store->Find(NumberedId(1)));
  EXPECT_TRUE(store->Accepted(Command(3), At(30)));
}

TEST_F(JournalGuardTest, AnOlderCopyUnderARunningBridgeIsNotUsed) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 7}));
  const std::string copy = Copy();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  Remove();
  Move(copy, file_);
  EXPECT_FALSE(store->Accepted(Command(2), At(1)));
  store->Tick(At(20));
  EXPECT_NE(ErrorText(store->state()), "");
  EXPECT_FALSE(store->Find("axis1").datum) << "its datums are of another time";
}

TEST_F(JournalGuardTest, ALogThatIsDeletedUnderARunningBridgeIsNoticed) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  std::filesystem::remove(file_ + "-wal");
  EXPECT_FALSE(store->Accepted(Command(2), At(1)));
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("(or its -wal) was deleted"));
}

TEST_F(JournalGuardTest, AnOlderCopyBetweenTwoRunsIsRefusedUntilAPersonAcceptsIt) {
  std::string copy;
  {
    const auto store = OpenStore();
    ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 7}));
    copy = Copy();
    ASSERT_TRUE(store->Apply("axis1", DatumVoided{1, "zero"}));
  }
  Remove();
  Move(copy, file_);
  {
    const auto store = OpenStore();
    EXPECT_THAT(ErrorText(store->state()),
                AllOf(HasSubstr(" changes are missing"), HasSubstr("remove " + file_ + "-guard")));
    EXPECT_FALSE(store->Find("axis1").datum);
    EXPECT_FALSE(store->readable());
    EXPECT_EQ(store->ReserveEpochs(1, 1), 0);
  }
  std::filesystem::remove(file_ + "-guard");
  EXPECT_EQ(ErrorText(OpenStore()->state()), "");
  EXPECT_EQ(OpenStore()->Find("axis1").datum->counts, 7);
}

TEST_F(JournalGuardTest, AnotherJournalAndAMissingOneAreRefused) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  Move(file_, file_ + ".away");
  EXPECT_THAT(ErrorText(OpenStore()->state()), HasSubstr("is missing or empty, but " + file_ + "-guard shows"));
  EXPECT_FALSE(std::filesystem::exists(file_));
  const std::string other = folder_.path() + "/other/journal.db";
  { ASSERT_TRUE(SqliteStore(other, "press3").Accepted(Command(1), At(0))); }
  Move(other, file_);
  EXPECT_THAT(ErrorText(OpenStore()->state()), HasSubstr("is not the journal that was used last"));
  Remove();
  Move(file_ + ".away", file_);
  EXPECT_EQ(ErrorText(OpenStore()->state()), "");
}

TEST_F(JournalGuardTest, ASecondProcessIsToldWhoHasTheJournalUntilThatIsKilled) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    const SqliteStore store(file_, "press3");
    const char ready = store.state().has_value() ? 'y' : 'n';
    if (write(ends[1], &ready, 1) != 1) _exit(1);
    while (true) pause();
  }
  ASSERT_GT(child, 0);
  char ready = 0;
  ASSERT_EQ(read(ends[0], &ready, 1), 1);
  ASSERT_EQ(ready, 'y');
  {
    const auto store = OpenStore();
    EXPECT_TRUE(store->in_use());
    EXPECT_THAT(ErrorText(store->state()), AllOf(HasSubstr("is the journal of another bridge, which runs: "),
                                                 HasSubstr("process " + std::to_string(child))));
    EXPECT_FALSE(store->Accepted(Command(1), At(0)));
  }
  ASSERT_EQ(kill(child, SIGKILL), 0);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  close(ends[0]);
  close(ends[1]);
  const auto store = OpenStore();
  EXPECT_FALSE(store->in_use());
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
}

}  // namespace
}  // namespace axlecast
