#include "core/config/config_file.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace axlecast {
namespace {

constexpr std::size_t kMaxRead = 1UL << 20;  // ParseYaml refuses what is longer than half of it

class OpenFile {
 public:
  // O_NONBLOCK: opening a FIFO that nobody writes must not wait.
  explicit OpenFile(const std::string& path)
      : fd_(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)) {}
  ~OpenFile() {
    if (fd_ >= 0) close(fd_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

const char* KindText(mode_t mode) {
  if (S_ISFIFO(mode)) return "a FIFO (named pipe)";
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

// Returns true if the owner is the only member of the group.
bool IsPrivateGroup(uid_t owner, gid_t group) {
  const passwd* const user = getpwuid(owner);
  // An account that this host does not know, for example of a container's host.
  if (user == nullptr) return owner == group && getgrgid(group) == nullptr;
  if (user->pw_gid != group) return false;
  const std::string name = user->pw_name;
  const struct group* const found = getgrgid(group);
  return found != nullptr && name == found->gr_name && found->gr_mem[0] == nullptr;
}

Result<> CheckWriters(const struct stat& status) {
  const bool by_all = (status.st_mode & S_IWOTH) != 0;
  const bool by_group = (status.st_mode & S_IWGRP) != 0 && !IsPrivateGroup(status.st_uid, status.st_gid);
  if (!by_all && !by_group) return {};
  return Failure(
      std::string("can be written by ") + (by_all ? "every user" : "its group") +
      ": who can write this file decides who may command the machine; check its content, then chmod go-w it");
}

Error CannotRead() { return {std::string("cannot be read: ") + std::strerror(errno)}; }

}  // namespace

Result<std::string> ReadConfigFile(const std::string& path, ConfigWriters writers) {
  const OpenFile file(path);
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) return Failure(CannotRead());
  if (!S_ISREG(status.st_mode)) {
    return Failure(std::string("cannot be read: it is ") + KindText(status.st_mode) +
                   "; name a regular file that describes the machine");
  }
  std::string text;
  std::array<char, 16'384> block{};
  while (text.size() < kMaxRead) {
    const ssize_t count = read(file.get(), block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Failure(CannotRead());
    if (count == 0) break;
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  if (const Result<> safe = CheckWriters(status); !safe && writers == ConfigWriters::kOwner)
    return Failure(safe.error());
  return text;
}

bool OthersMayWriteConfig(const std::string& file) {
  struct stat status {};
  return stat(file.c_str(), &status) == 0 && !CheckWriters(status);
}

}  // namespace axlecast
