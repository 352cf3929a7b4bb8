#include "platform/os/supervision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>

#include "platform/os/descriptor.h"
#include "tests/support/temporary_folder.h"

namespace axlecast {
namespace {

// Stands in for systemd: sd_notify(3) sends datagrams to the socket named by NOTIFY_SOCKET.
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
