#include "core/config/config_file.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

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

// Whether the group is the one that the owner alone is in.
bool IsPrivateGroup(uid_t owner, gid_t group) {
  const passwd* const user = getpwuid(owner);
  // Of an account that this host does not know, such as that of a container's host.
  if (user == nullptr) return owner == group && getgrgid(group) == nullptr;
  if (user->pw_gid != group) return false;
  const std::string name = user->pw_name;
  const struct group* const found = getgrgid(group);
  return found != nullptr && name == found->gr_name && found->gr_mem[0] == nullptr;
}

std::string WriterProblem(const struct stat& status) {
  const bool by_group = (status.st_mode & S_IWGRP) != 0 && !IsPrivateGroup(status.st_uid, status.st_gid);
  if ((status.st_mode & S_IWOTH) == 0 && !by_group) return "";
  return std::string("can be written by ") + ((status.st_mode & S_IWOTH) != 0 ? "every user" : "its group") +
         ": whoever can write this file decides who may command the machine; check its content, then chmod go-w it";
}

std::string ReadAll(int fd, std::string& text) {
  std::array<char, 16'384> block{};
  while (text.size() < kMaxRead) {
    const ssize_t count = read(fd, block.data(), block.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return std::string("cannot be read: ") + std::strerror(errno);
    if (count == 0) break;
    text.append(block.data(), static_cast<std::size_t>(count));
  }
  return "";
}

// `writers` becomes the problem with those who may write the file; empty: there is none.
std::string Read(const std::string& path, std::string& text, std::string& writers) {
  const OpenFile file(path);
  struct stat status {};
  if (file.get() < 0 || fstat(file.get(), &status) != 0) {
    return std::string("cannot be read: ") + std::strerror(errno);
  }
  if (!S_ISREG(status.st_mode)) {
    return std::string("cannot be read: it is ") + KindText(status.st_mode) +
           "; name a regular file that describes the machine";
  }
  writers = WriterProblem(status);
  return ReadAll(file.get(), text);
}

bool Report(const std::string& problem, ConfigErrors& errors) {
  if (!problem.empty()) errors.Add(YAML::Mark::null_mark(), problem);
  return problem.empty();
}

}  // namespace

bool ReadConfigFile(const std::string& file, std::string& text, ConfigErrors& errors) {
  text.clear();
  std::string writers;
  return Report(Read(file, text, writers), errors) && Report(writers, errors);
}

bool ReadSharedConfigFile(const std::string& file, std::string& text, ConfigErrors& errors) {
  text.clear();
  std::string writers;
  return Report(Read(file, text, writers), errors);
}

bool OthersMayWriteConfig(const std::string& file) {
  struct stat status {};
  return stat(file.c_str(), &status) == 0 && !WriterProblem(status).empty();
}

}  // namespace axlecast
