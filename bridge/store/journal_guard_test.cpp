#include "bridge/store/sqlite_store.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "bridge/store/store_fixture.h"
#include "tests/disk/file_calls.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// This process and its children run on one processor while it lives: the kernel lists the locks of each processor by themselves.
class OneProcessor {
 public:
  OneProcessor() : before_(Allowed()) { Allow(before_.substr(0, before_.find_first_of(",-"))); }
  ~OneProcessor() { Allow(before_); }
  OneProcessor(const OneProcessor&) = delete;
  OneProcessor& operator=(const OneProcessor&) = delete;

 private:
  static std::string Allowed() {
    std::ifstream status("/proc/self/status");
    std::string word;
    while (status >> word && word != "Cpus_allowed_list:") continue;
    status >> word;
    return word;
  }
  static void Allow(const std::string& processors) {
    const std::string command = "taskset -cp " + processors + " " + std::to_string(getpid()) + " > /dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c)
  }

  const std::string before_;
};

class JournalGuardTest : public StoreTest {
 protected:
  void Move(const std::string& from, const std::string& to) const {
    for (const char* end : {"", "-wal", "-shm"}) {
      if (std::filesystem::exists(from + end)) std::filesystem::rename(from + end, to + end);
    }
  }
  [[nodiscard]] std::string Guard() const {
    std::ifstream file(file_ + "-guard");
    return {std::istreambuf_iterator<char>(file), {}};
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

TEST_F(JournalGuardTest, AFileThatIsDeletedIsNoticedWithoutAChange) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  store->Tick(At(10));
  EXPECT_EQ(ErrorText(store->state()), "");
  Move(file_, file_ + ".away");
  store->Tick(At(19.9));
  EXPECT_EQ(ErrorText(store->state()), "") << "it is looked at every 10 s";
  store->Tick(At(20));
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("was deleted, moved or replaced while the bridge used it"));
  EXPECT_FALSE(store->readable());
}

TEST_F(JournalGuardTest, TheGuardHasTheIdAndTheNumberOfChanges) {
  const auto store = OpenStore();
  EXPECT_EQ(Guard(), "") << "nothing was written";
  for (std::uint32_t number = 1; number <= 3; ++number) {
    ASSERT_TRUE(store->Accepted(Command(number), At(0)));
    EXPECT_EQ(Guard(),
              Ask("SELECT printf('axlecast-journal-guard 1 %016x %020d', (SELECT value FROM meta WHERE key = "
                  "'journal_id'), value) FROM meta WHERE key = 'changes'"));
    EXPECT_EQ(Ask("SELECT value FROM meta WHERE key = 'changes'"), std::to_string(number) + "\n");
  }
}

TEST_F(JournalGuardTest, EachJournalHasAnIdOfItsOwn) {
  std::set<std::int64_t> ids;
  for (int i = 0; i < 20; ++i) {
    for (const char* end : {"", "-wal", "-shm", "-guard"}) std::filesystem::remove(file_ + end);
    ASSERT_EQ(ErrorText(OpenStore()->state()), "");
    ids.insert(std::stoll(Ask("SELECT value FROM meta WHERE key = 'journal_id'")));
  }
  const std::string id = Ask("SELECT value FROM meta WHERE key = 'journal_id'");
  EXPECT_TRUE(OpenStore()->Accepted(Command(1), At(0)));
  EXPECT_EQ(Ask("SELECT value FROM meta WHERE key = 'journal_id'"), id) << "which it keeps";
  EXPECT_EQ(ids.size(), 20U);
  EXPECT_GT(*ids.begin(), 0);
  EXPECT_GT(*ids.rbegin(), std::int64_t{1} << 40);
}

TEST_F(JournalGuardTest, AGuardThatIsNotReadableIsAsNone) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  for (const char* text : {"", "nonsense", "axlecast-journal-guard 1 0000000000000005"}) {
    std::ofstream(file_ + "-guard") << text;
    EXPECT_EQ(ErrorText(OpenStore()->state()), "") << text;
  }
}

TEST_F(JournalGuardTest, AGuardThatCannotBeWrittenKeepsNothingFromBeingStored) {
  std::filesystem::create_directories(file_ + "-guard");
  const auto store = OpenStore();
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
  EXPECT_EQ(ErrorText(store->state()), "");
  std::filesystem::remove(file_ + "-guard");
  EXPECT_TRUE(store->Accepted(Command(2), At(0)));
  EXPECT_THAT(Guard(), HasSubstr(" 00000000000000000002\n"));
}

TEST_F(JournalGuardTest, AGuardThatIsALinkIsNotFollowed) {
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path());
  std::ofstream(folder_.path() + "/other") << "of another program";
  std::filesystem::create_symlink(folder_.path() + "/other", file_ + "-guard");
  EXPECT_TRUE(OpenStore()->Accepted(Command(1), At(0)));
  EXPECT_EQ(Guard(), "of another program");
}

TEST_F(JournalGuardTest, AGuardWhoseDiskHasFailedIsOpenedAgain) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  FileCalls::PlantFailure("pwrite", file_ + "-guard", EIO);
  ASSERT_TRUE(store->Accepted(Command(2), At(0)));
  EXPECT_THAT(Guard(), HasSubstr(" 00000000000000000001\n"));
  std::filesystem::remove(file_ + "-guard");
  ASSERT_TRUE(store->Accepted(Command(3), At(0)));
  EXPECT_THAT(Guard(), HasSubstr(" 00000000000000000003\n"));
}

TEST_F(JournalGuardTest, AnEmptyFileInThePlaceOfAJournalIsRefused) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  Move(file_, file_ + ".away");
  std::ofstream(file_) << "";
  EXPECT_THAT(ErrorText(OpenStore()->state()), HasSubstr("is missing or empty, but " + file_ + "-guard shows"));
}

TEST_F(JournalGuardTest, AFileThatCannotBeOpenedForTheLockIsAnError) {
  for (const char* call : {"open", "fstat"}) {
    FileCalls::PlantFailure(call, file_, EMFILE, 1);  // after that of PrepareFile
    const auto store = OpenStore();
    EXPECT_EQ(ErrorText(store->state()), file_ + ": Too many open files") << call;
    EXPECT_FALSE(store->in_use());
  }
}

// As on a file system that has no locks: the bridge works without.
TEST_F(JournalGuardTest, AFileSystemWithoutLocksIsUsed) {
  FileCalls::PlantFailure("flock", file_, ENOLCK);
  const auto store = OpenStore();
  EXPECT_FALSE(store->in_use());
  EXPECT_TRUE(store->Accepted(Command(1), At(0)));
}

TEST_F(JournalGuardTest, ItsLockIsNotInheritedByOtherPrograms) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code error;
    const std::string path = std::filesystem::read_symlink(entry.path(), error);
    if (!path.starts_with(file_)) continue;
    ++files;
    EXPECT_EQ(fcntl(std::stoi(entry.path().filename()), F_GETFD), FD_CLOEXEC) << path;
  }
  EXPECT_GE(files, 4) << "the lock, the file, its log and the guard";
}

TEST_F(JournalGuardTest, TheLockOfAFileThatWasMovedAwayIsGivenBack) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  SqliteStore store(file_, "press4");  // which has the lock, and does not use the file
  std::filesystem::create_directories(folder_.path() + "/other");
  const std::string other = folder_.path() + "/other/journal.db";
  Move(file_, other);
  EXPECT_TRUE(SqliteStore(other, "press3").in_use());
  store.Tick(At(20));
  EXPECT_THAT(ErrorText(store.state()), HasSubstr("is missing or empty"));
  EXPECT_EQ(ErrorText(SqliteStore(other, "press3").state()), "");
}

TEST_F(JournalGuardTest, AnIdThatCannotBeWrittenIsAnError) {
  { ASSERT_EQ(ErrorText(OpenStore()->state()), ""); }
  std::filesystem::remove(file_ + "-guard");
  ASSERT_EQ(
      Ask("DELETE FROM meta WHERE key = 'journal_id'; CREATE TRIGGER fails BEFORE INSERT ON meta BEGIN SELECT "
          "RAISE(ABORT, 'planted'); END"),
      "");
  EXPECT_EQ(ErrorText(OpenStore()->state()), file_ + ": planted");
}

TEST_F(JournalGuardTest, TheNumberOfChangesThatAreMissingIsExact) {
  { ASSERT_TRUE(OpenStore()->Accepted(Command(1), At(0))); }
  ASSERT_EQ(Ask("UPDATE meta SET value = value - 1 WHERE key = 'changes'"), "");
  EXPECT_THAT(ErrorText(OpenStore()->state()), HasSubstr("(1 changes are missing)"));
  ASSERT_EQ(Ask("UPDATE meta SET value = value + 3 WHERE key = 'changes'"), "");
  EXPECT_EQ(ErrorText(OpenStore()->state()), "") << "after a power failure, the guard may lag behind";
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

TEST_F(JournalGuardTest, ACopyInThePlaceOfTheFileIsNotUsedEither) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 7}));
  const std::string copy = Copy();
  Remove();
  Move(copy, file_);
  EXPECT_FALSE(store->Accepted(Command(1), At(1)));
  store->Tick(At(20));
  EXPECT_FALSE(store->readable()) << "another program may have written it since";
  EXPECT_FALSE(store->Find("axis1").datum);
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
    std::string name;
    std::getline(std::ifstream("/proc/self/comm"), name);
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("is the journal of another bridge, which runs: " + name +
                                                     ", process " + std::to_string(child) + "; stop"));
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

TEST_F(JournalGuardTest, ALockOfAnotherHostIsOfAnotherProcess) {
  FileCalls::PlantFailure("flock", file_, EWOULDBLOCK);  // and /proc/locks does not list it
  const auto store = OpenStore();
  EXPECT_TRUE(store->in_use());
  EXPECT_THAT(ErrorText(store->state()), HasSubstr("which runs: another process; stop"));
}

// A child that has a file open, as `open_file` does it, until Stop.
class Holder {
 public:
  template <typename OpenFile>
  explicit Holder(const OpenFile& open_file) {
    int ready[2];
    if (pipe(ready) != 0 || pipe(end_) != 0) return;
    child_ = fork();
    char byte = 'y';
    if (child_ == 0) {
      close(end_[1]);
      [[maybe_unused]] const auto opened = open_file();
      if (write(ready[1], &byte, 1) != 1) _exit(1);
      _exit(read(end_[0], &byte, 1) == 0 ? 0 : 1);
    }
    ready_ = read(ready[0], &byte, 1) == 1;
    for (const int file : ready) close(file);
  }
  ~Holder() {
    for (const int file : end_) close(file);
    waitpid(child_, nullptr, 0);
  }
  Holder(const Holder&) = delete;
  Holder& operator=(const Holder&) = delete;

  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] pid_t process() const { return child_; }

 private:
  int end_[2] = {-1, -1};
  pid_t child_ = -1;
  bool ready_ = false;
};

// Each program that reads the journal has locks on it as well, which the kernel lists in the order in which they were taken.
TEST_F(JournalGuardTest, AReaderIsNotNamedAsTheBridge) {
  { ASSERT_EQ(ErrorText(OpenStore()->state()), ""); }
  const OneProcessor pinned;
  const auto read = [this] { return Database::Open(file_, Database::Access::kReadOnly); };
  const auto lock = [this] { return flock(open(file_.c_str(), O_RDONLY), LOCK_EX); };
  // Destroyed in the opposite order: each child has the pipes of those before it.
  const Holder before(read);
  const Holder bridge(lock);
  const Holder after(read);
  ASSERT_TRUE(before.ready() && bridge.ready() && after.ready());
  EXPECT_THAT(ErrorText(OpenStore()->state()),
              HasSubstr(", process " + std::to_string(bridge.process()) + "; stop"));
}

// The kernel names who took a lock, and not who has inherited it since.
TEST_F(JournalGuardTest, ALockWhoseTakerHasEndedHasNoName) {
  { ASSERT_EQ(ErrorText(OpenStore()->state()), ""); }
  int ready[2];
  int end[2];
  ASSERT_EQ(pipe(ready), 0);
  ASSERT_EQ(pipe(end), 0);
  const pid_t child = fork();
  if (child == 0) {
    const int file = open(file_.c_str(), O_RDONLY);
    if (flock(file, LOCK_EX) != 0) _exit(1);
    if (fork() != 0) _exit(0);
    close(ready[0]);
    close(end[1]);
    char byte = 0;
    _exit(read(end[0], &byte, 1) == 0 ? 0 : 1);
  }
  ASSERT_GT(child, 0);
  close(end[0]);
  close(ready[1]);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  EXPECT_THAT(ErrorText(OpenStore()->state()),
              HasSubstr("which runs: a process, process " + std::to_string(child) + "; stop"));
  close(end[1]);
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 0) << "it has ended";
  close(ready[0]);
  EXPECT_EQ(ErrorText(OpenStore()->state()), "");
}

}  // namespace
}  // namespace axlecast
