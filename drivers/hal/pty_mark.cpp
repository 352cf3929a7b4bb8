#include "drivers/hal/pty_mark.h"

#include <sys/ioctl.h>
#include <sys/stat.h>

#include <bit>
#include <filesystem>
#include <system_error>

namespace axlecast {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  // as many as the kernel follows

static_assert(sizeof(winsize) == sizeof(std::uint64_t));

// The finalizer of splitmix64: every bit of the input reaches every bit of the result.
std::uint64_t Mix(std::uint64_t value) {
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9U;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBU;
  return value ^ (value >> 31U);
}

std::uint64_t MarkOf(const struct stat& link) {
  std::uint64_t mark = Mix(link.st_ino);
  mark = Mix(mark ^ static_cast<std::uint64_t>(link.st_mtim.tv_sec));
  mark = Mix(mark ^ static_cast<std::uint64_t>(link.st_mtim.tv_nsec));
  return mark != 0 ? mark : 1;
}

}  // namespace

std::uint64_t MarkOfLink(const std::string& path) {
  fs::path place = path;
  std::uint64_t mark = 0;
  for (int i = 0; i < kMaxLinks; ++i) {
    struct stat status {};
    if (lstat(place.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) break;
    mark = MarkOf(status);
    std::error_code failed;
    const fs::path target = fs::read_symlink(place, failed);
    if (failed) return 0;
    place = place.parent_path() / target;  // an absolute target replaces the folder
  }
  return mark;
}

std::uint64_t ReadMark(int terminal) {
  winsize size{};
  return ioctl(terminal, TIOCGWINSZ, &size) == 0 ? std::bit_cast<std::uint64_t>(size) : 0;
}

bool WriteMark(int terminal, std::uint64_t mark) {
  const auto size = std::bit_cast<winsize>(mark);
  return ioctl(terminal, TIOCSWINSZ, &size) == 0;
}

}  // namespace axlecast
