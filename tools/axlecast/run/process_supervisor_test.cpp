#include "tools/axlecast/run/process_supervisor.h"

#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <array>
#include <csignal>
#include <fstream>
#include <sstream>

#include "platform/os/process.h"
#include "tests/support/fake_clock.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

constexpr int kLimitMs = 30'000;  // generous: for a host that is busy with something else

// A stop that came between fork and exec ran this process's handler in the child, and the program never learned of it.
TEST(ChildProcess, EndsAtASignalThatComesBeforeItsProgramRuns) {
  const StopSignal stop;
  for (int i = 0; i < 20; ++i) {
    ChildProcess child;
    ASSERT_TRUE(child.Start({"/bin/sleep", "1000"}, -1));
    child.Signal(SIGTERM);
    pollfd output{child.FileDescriptor(), POLLIN, 0};
    ASSERT_EQ(poll(&output, 1, kLimitMs), 1) << "it does not stop";
    std::optional<ChildProcess::End> end;
    while (!end) end = child.Reap();
    EXPECT_EQ(end->text, "killed by signal 15 (Terminated)");
  }
  EXPECT_FALSE(stop.Requested());
  pollfd event{stop.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&event, 1, 0), 0) << "the child stopped this process";
}

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

std::vector<std::string> Shell(const std::string& script) { return {"/bin/sh", "-c", script}; }

std::string Content(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class FleetTest : public ::testing::Test {
 protected:
  // Waits for the children's output, at most 10 s in all.
  template <typename Condition>
  void PollUntil(const Condition& condition) {
    for (int i = 0; i < 1000 && !condition(); ++i) {
      fleet_.Poll();
      std::vector<pollfd> outputs;
      for (const int fd : fleet_.FileDescriptors()) outputs.push_back({fd, POLLIN, 0});
      poll(outputs.data(), outputs.size(), 10);
    }
    EXPECT_TRUE(condition());
  }

  FakeClock clock_;
  std::vector<std::string> told_;
  const TemporaryFolder folder_;
  const std::string logs_ = folder_.path();
  ProcessSupervisor fleet_{logs_, clock_, [this](const std::string& line) { told_.push_back(line); }};
};

TEST_F(FleetTest, LogsAllAndShowsWarnings) {
  fleet_.Start(
      ProcessSupervisor::Role::kDriver, "driver a",
      Shell("echo result; echo '[info] quiet' >&2; echo '[warning] loud' >&2; printf unfinished >&2; exit 3"));
  PollUntil([this] { return !fleet_.deaths().empty(); });
  EXPECT_THAT(fleet_.deaths(), ElementsAre("driver a: exit code 3: unfinished")) << "with its last words";
  EXPECT_THAT(told_, ElementsAre("driver a: [warning] loud", "driver a: unfinished",
                                 "driver a ended: exit code 3; starting it again in 0.5 s"));
  EXPECT_THAT(Content(logs_ + "/driver-a.log"),
              AllOf(HasSubstr("result\n"), HasSubstr("[info] quiet\n[warning] loud\nunfinished\n")));
}

TEST_F(FleetTest, StartsTheDeadAgainWithGrowingPauses) {
  fleet_.Start(ProcessSupervisor::Role::kDriver, "d", Shell("exit 1"));
  PollUntil([this] { return fleet_.deaths().size() == 1; });
  clock_.Advance(499 * kMillisecond);
  fleet_.Poll();
  EXPECT_THAT(fleet_.FileDescriptors(), IsEmpty());
  clock_.Advance(kMillisecond);
  PollUntil([this] { return fleet_.deaths().size() == 2; });
  EXPECT_EQ(told_.back(), "d ended: exit code 1; starting it again in 1 s");
}

TEST_F(FleetTest, TellsTheSignalThatKilled) {
  fleet_.Start(ProcessSupervisor::Role::kBridge, "bridge", Shell("kill -9 $$"));
  PollUntil([this] { return !fleet_.deaths().empty(); });
  EXPECT_THAT(fleet_.deaths(), ElementsAre("bridge: killed by signal 9 (Killed)"));
}

TEST_F(FleetTest, AMissingProgramIsTold) {
  fleet_.Start(ProcessSupervisor::Role::kDriver, "d", {"/nonexistent/program"});
  PollUntil([this] { return !fleet_.deaths().empty(); });
  EXPECT_THAT(told_, Contains("d: cannot run /nonexistent/program: No such file or directory"));
}

TEST_F(FleetTest, StopEndsDriversFirstAndTheRecorderLast) {
  const std::string order = logs_ + "/order";
  const auto polite = [&order](const std::string& name) {
    return Shell("trap 'echo " + name + " >> " + order +
                 "; exit 0' TERM; echo ready >&2; while :; do sleep 0.01; done");
  };
  fleet_.Start(ProcessSupervisor::Role::kRecorder, "r", polite("recorder"));
  fleet_.Start(ProcessSupervisor::Role::kSimulator, "s", polite("simulator"));
  fleet_.Start(ProcessSupervisor::Role::kBridge, "b", polite("bridge"));
  fleet_.Start(ProcessSupervisor::Role::kDriver, "d", polite("driver"));
  PollUntil([this] { return told_.size() == 4; });
  fleet_.Stop([] { return false; });
  EXPECT_EQ(Content(order), "driver\nbridge\nsimulator\nrecorder\n");
  EXPECT_THAT(fleet_.deaths(), IsEmpty());
}

TEST_F(FleetTest, StopKillsWhatDoesNotEnd) {
  fleet_.Start(ProcessSupervisor::Role::kDriver, "d",
               Shell("trap '' TERM; echo ready >&2; while :; do sleep 0.01; done"));
  PollUntil([this] { return told_.size() == 1; });
  fleet_.Stop([this] {
    clock_.Advance(kSecond);
    return false;
  });
  EXPECT_EQ(told_.back(), "d does not end: killed");
}

TEST_F(FleetTest, ARecorderMayTakeLongerToWriteWhatItHolds) {
  const std::string late = logs_ + "/late";
  fleet_.Start(ProcessSupervisor::Role::kRecorder, "r",
               Shell("trap 'while [ ! -e " + late +
                     " ]; do sleep 0.01; done; exit 0' TERM; echo ready >&2; "
                     "while :; do sleep 0.01; done"));
  PollUntil([this] { return told_.size() == 1; });
  fleet_.Stop([&] {
    clock_.Advance(kSecond);
    if (clock_.Now() > 1'010 * kSecond) std::ofstream(late).put('x');
    return false;
  });
  EXPECT_THAT(told_, Not(Contains(HasSubstr("killed"))));
}

TEST(ChildProcess, DiesWithItsParent) {
  // The middle process starts a child that writes its id, then is killed: the child's pipe must close.
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t middle = fork();
  ASSERT_GE(middle, 0);
  if (middle == 0) {
    ChildProcess child;
    static_cast<void>(child.Start(Shell("echo ready >&2; exec sleep 1000"), -1));
    while (child.ReadLines().empty()) poll(nullptr, 0, 5);
    const pid_t id = child.pid();
    static_cast<void>(write(ends[1], &id, sizeof id));
    for (;;) pause();
  }
  pid_t id = 0;
  ASSERT_EQ(read(ends[0], &id, sizeof id), static_cast<ssize_t>(sizeof id));
  kill(middle, SIGKILL);
  waitpid(middle, nullptr, 0);
  const auto gone = [id] {
    const std::string state = Content("/proc/" + std::to_string(id) + "/stat");
    return state.empty() || state.find(") Z ") != std::string::npos;
  };
  for (int i = 0; i < 1000 && !gone(); ++i) poll(nullptr, 0, 10);
  EXPECT_TRUE(gone());
  close(ends[0]);
  close(ends[1]);
}

TEST(ChildProcess, CutsEndlessLines) {
  ChildProcess child;
  ASSERT_TRUE(child.Start(Shell("exec >&2; head -c 10000 /dev/zero | tr '\\0' x; echo; echo end"), -1));
  std::vector<std::string> lines;
  for (int i = 0; i < 1000 && (lines.empty() || lines.back() != "end"); ++i) {
    for (std::string& line : child.ReadLines()) lines.push_back(std::move(line));
    poll(nullptr, 0, 5);
  }
  ASSERT_THAT(lines, SizeIs(4));
  EXPECT_EQ(lines[0].size(), 4096U);
  EXPECT_EQ(lines[2].size(), 10000U - 2 * 4096U);
}

}  // namespace

}  // namespace axlecast
