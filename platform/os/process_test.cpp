#include "platform/os/process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <set>
#include <string>
#include <thread>

#include "core/base/result.h"
#include "platform/os/descriptor.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(RandomBootId, IsPositiveAndNew) {
  std::set<std::int64_t> ids;
  for (int i = 0; i < 100; ++i) {
    ids.insert(RandomBootId());
    EXPECT_GT(*ids.begin(), 0);
  }
  EXPECT_EQ(ids.size(), 100U);
}

TEST(LowerPriority, ConcernsOnlyTheCallingThread) {
  const int before = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
  int lowered = 0;
  std::thread([&lowered] {
    LowerPriority();
    lowered = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
  }).join();
  EXPECT_EQ(lowered, 19);
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())), before);
}

TEST(ApplyRealtime, AppliesWhatIsAllowedAndTellsTheRest) {
  std::thread([] {
    EXPECT_THAT(ApplyRealtime(0, -1, false), IsEmpty());
    EXPECT_EQ(prctl(PR_GET_TIMERSLACK), 1);
    const auto warnings = ApplyRealtime(0, 1023, false);  // no such processor
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_THAT(warnings[0], HasSubstr("realtime.cpu 1023"));
    EXPECT_THAT(warnings[0], HasSubstr("lscpu"));
  }).join();
}

// In a child: the tests' own process stays open to sanitizers.
TEST(ForbidCoreDumps, ShutsTheProcess) {
  const auto forbid_and_look = [] {
    const std::string problem = ErrorText(ForbidCoreDumps());
    rlimit core{1, 1};
    getrlimit(RLIMIT_CORE, &core);
    _exit(problem.empty() && prctl(PR_GET_DUMPABLE) == 0 && core.rlim_cur == 0 && core.rlim_max == 0 ? 0 : 1);
  };
  EXPECT_EXIT(forbid_and_look(), ::testing::ExitedWithCode(0), "");
  EXPECT_EQ(prctl(PR_GET_DUMPABLE), 1);
}

TEST(StopSignal, SeesBothSignalsAndCountsThem) {
  StopSignal stop;
  EXPECT_FALSE(stop.Requested());
  EXPECT_FALSE(stop.Wait(0));
  raise(SIGTERM);
  EXPECT_TRUE(stop.Wait(-1));
  raise(SIGINT);
  EXPECT_EQ(stop.Count(), 2);
}

TEST(StopSignal, AWaiterOnAnotherThreadIsWoken) {
  StopSignal stop;
  std::thread waiter([&] { EXPECT_TRUE(stop.Wait(-1)); });
  kill(getpid(), SIGTERM);
  waiter.join();
}

TEST(StopSignal, BlocksNothingAndGivesTheActionsBack) {
  sigset_t before;
  sigset_t during;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  {
    StopSignal stop;
    pthread_sigmask(SIG_SETMASK, nullptr, &during);
    EXPECT_EQ(sigismember(&before, SIGTERM), sigismember(&during, SIGTERM));
    EXPECT_EQ(sigismember(&before, SIGINT), sigismember(&during, SIGINT));
  }
  struct sigaction action {};
  sigaction(SIGTERM, nullptr, &action);
  EXPECT_EQ(action.sa_handler, SIG_DFL);
  EXPECT_FALSE(StopSignal().Requested()) << "a new one begins at zero";
}

// Replaces systemd: sd_notify(3) sends datagrams to the socket named by NOTIFY_SOCKET.
class SupervisionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    socket_ = Descriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    ASSERT_LT(path_.size(), sizeof address.sun_path);
    std::memcpy(address.sun_path, path_.c_str(), path_.size());
    ASSERT_EQ(bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    setenv("WATCHDOG_USEC", "3000000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
  }
  void TearDown() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID"}) unsetenv(name);
  }
  std::string Received() {
    std::array<char, 256> text;
    const ssize_t size = recv(socket_.get(), text.data(), text.size(), 0);
    return size < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(size));
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/notify";
  Descriptor socket_;
};

TEST_F(SupervisionTest, TellsItsStates) {
  Supervision supervision;
  supervision.Ready();
  EXPECT_EQ(Received(), "READY=1");
  supervision.Status("2 of 2 devices online");
  EXPECT_EQ(Received(), "STATUS=2 of 2 devices online");
  supervision.Stopping();
  EXPECT_EQ(Received(), "STOPPING=1");
}

TEST_F(SupervisionTest, FeedsTheWatchdogThreeTimesPerPeriodAndOnlyOnProgress) {
  Supervision supervision;
  EXPECT_EQ(supervision.ping_interval(), kSecond);
  const MonoNs start = 77 * kSecond;
  supervision.Progress(start);
  EXPECT_EQ(Received(), "WATCHDOG=1");
  supervision.Progress(start + kMicrosecond);
  supervision.Progress(start + kSecond - 1);
  EXPECT_EQ(Received(), "") << "not more often than needed";
  supervision.Progress(start + kSecond);
  EXPECT_EQ(Received(), "WATCHDOG=1");
}

TEST_F(SupervisionTest, WithoutSystemdNothingHappens) {
  unsetenv("WATCHDOG_USEC");
  Supervision supervision;
  EXPECT_EQ(supervision.ping_interval(), kNever);
  supervision.Progress(kSecond);
  EXPECT_EQ(Received(), "");
  unsetenv("NOTIFY_SOCKET");
  supervision.Ready();
  EXPECT_EQ(Received(), "");
}

}  // namespace

}  // namespace axlecast
