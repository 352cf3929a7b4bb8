#include "tools/axlecast/run/child_process.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <csignal>

#include "platform/os/process.h"

namespace axlecast {
namespace {

constexpr int kLimitMs = 30'000;  // generous: for a host that is busy with something else

// A stop that came between fork and exec ran this process's handler in the child, and the program never learned of it.
TEST(ChildProcess, EndsAtASignalThatComesBeforeItsProgramRuns) {
  const StopSignal stop;
  for (int i = 0; i < 20; ++i) {
    ChildProcess child;
    ASSERT_EQ(child.Start({"/bin/sleep", "1000"}, -1), "");
    child.Signal(SIGTERM);
    pollfd output{child.FileDescriptor(), POLLIN, 0};
    ASSERT_EQ(poll(&output, 1, kLimitMs), 1) << "it goes on";
    std::optional<ChildProcess::End> end;
    while (!end) end = child.Reap();
    EXPECT_EQ(end->text, "killed by signal 15 (Terminated)");
  }
  EXPECT_FALSE(stop.Requested());
  pollfd event{stop.FileDescriptor(), POLLIN, 0};
  EXPECT_EQ(poll(&event, 1, 0), 0) << "the child told us to stop";
}

}  // namespace
}  // namespace axlecast
