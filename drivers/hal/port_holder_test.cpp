#include "drivers/hal/line_guard.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <functional>
#include <string>

namespace axlecast {
namespace {

// A process that has taken something, until it goes.
class Other {
 public:
  explicit Other(const std::function<bool()>& take) {
    std::array<int, 2> ready{};
    EXPECT_EQ(pipe(ready.data()), 0);
    id_ = fork();
    if (id_ == 0) {
      const char done = take() ? 'y' : 'n';
      static_cast<void>(!write(ready[1], &done, 1));
      for (;;) pause();
    }
    close(ready[1]);
    char done = 'n';
    EXPECT_EQ(read(ready[0], &done, 1), 1);
    EXPECT_EQ(done, 'y');
    close(ready[0]);
  }
  ~Other() {
    kill(id_, SIGKILL);
    waitpid(id_, nullptr, 0);
  }
  Other(const Other&) = delete;
  Other& operator=(const Other&) = delete;

  [[nodiscard]] std::string Process() const { return ", process " + std::to_string(id_); }

 private:
  pid_t id_ = -1;
};

bool Bind(const std::string& name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(&address.sun_path[1], sizeof address.sun_path - 1);
  const int socket_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  return bind(socket_fd, reinterpret_cast<const sockaddr*>(&address), size) == 0;
}

TEST(PortHolder, NamesTheProcessThatHasADeviceOpen) {
  EXPECT_EQ(PortHolder("/nonexistent/port"), "");
  EXPECT_EQ(PortHolder("/etc/hostname"), "") << "no device";
  const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(terminal, 0);
  ASSERT_EQ(unlockpt(terminal), 0);
  const std::string path = ptsname(terminal);
  EXPECT_EQ(PortHolder(path), "");
  const Other other([&path] { return open(path.c_str(), O_RDWR | O_NOCTTY) >= 0; });
  const std::string holder = PortHolder(path);
  EXPECT_TRUE(holder.ends_with(other.Process())) << holder;
  EXPECT_FALSE(holder.starts_with(',')) << "with its name";
  close(terminal);
}

TEST(PortHolder, NamesTheProcessThatDrivesACanInterface) {
  const std::string interface = "can" + std::to_string(getpid());
  EXPECT_EQ(PortHolder(interface), "");
  const Other other([&interface] { return Bind(CanLockName(interface)); });
  EXPECT_TRUE(PortHolder(interface).ends_with(other.Process())) << PortHolder(interface);
  EXPECT_EQ(PortHolder(interface + "0"), "") << "another interface";
}

}  // namespace
}  // namespace axlecast
