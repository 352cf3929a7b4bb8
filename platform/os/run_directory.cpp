#include "platform/os/run_directory.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>

namespace axlecast {
namespace {

constexpr const char* kElsewhere = "; remove it, or set AXLECAST_RUN_DIR to another directory";

std::string Problem(const std::string& path) { return path + ": " + std::strerror(errno) + kElsewhere; }

bool OthersMayWrite(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) != 0;
}

// Where others may write, a directory must be ours, or root's, and no link: else they could put another in its
// place.
std::string CheckOwner(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return Problem(path);
  if (!S_ISDIR(status.st_mode)) return path + " is no directory (a link?)" + kElsewhere;
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return path + " belongs to user " + std::to_string(status.st_uid) + ", not to us" + kElsewhere;
  }
  return "";
}

}  // namespace

std::string PrepareRunDirectory(const std::string& path) {
  std::filesystem::path walked;
  for (const auto& part : std::filesystem::path(path).lexically_normal()) {
    const bool exposed = !walked.empty() && OthersMayWrite(walked);
    walked /= part;
    if (mkdir(walked.c_str(), 0700) != 0 && errno != EEXIST) return Problem(walked);
    if (!exposed) continue;
    if (std::string problem = CheckOwner(walked); !problem.empty()) return problem;
  }
  const Descriptor directory(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!directory.valid()) return Problem(path);
  struct stat status {};
  if (fstat(directory.get(), &status) != 0) return Problem(path);
  if (status.st_uid != geteuid()) {
    return path + " belongs to user " + std::to_string(status.st_uid) + ", not to us" + kElsewhere;
  }
  return fchmod(directory.get(), 0700) == 0 ? "" : Problem(path);
}

std::string LockFile::Acquire(const std::string& path) {
  Descriptor file(open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file.valid()) return path + ": " + std::strerror(errno);
  if (flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return path + ": " + std::strerror(errno);
    std::array<char, 16> holder{};
    const ssize_t size = pread(file.get(), holder.data(), holder.size() - 1, 0);
    return path + " is held by process " + (size > 0 ? holder.data() : "(unknown)");
  }
  const std::string id = std::to_string(getpid());
  if (ftruncate(file.get(), 0) != 0 || pwrite(file.get(), id.data(), id.size(), 0) < 0) {
    return path + ": " + std::strerror(errno);
  }
  file_ = std::move(file);
  return "";
}

pid_t LockFile::Holder(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!file.valid() || flock(file.get(), LOCK_SH | LOCK_NB) == 0) return 0;
  std::array<char, 16> text{};
  const ssize_t size = pread(file.get(), text.data(), text.size() - 1, 0);
  pid_t holder = 0;
  if (size > 0) std::from_chars(text.data(), text.data() + size, holder);
  return holder;
}

}  // namespace axlecast
