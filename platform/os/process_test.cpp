#include "platform/os/process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <csignal>
#include <set>
#include <thread>

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
    const std::string problem = ForbidCoreDumps();
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
  EXPECT_FALSE(StopSignal().Requested()) << "a new one begins anew";
}

}  // namespace
}  // namespace axlecast
