#include "drivers/hal/pty.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
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

tl::unexpected<Error> SystemFailure(const std::string& what, const char* remedy = "") {
  return Failure(what + ": " + std::strerror(errno) + remedy);
}

// A host always finds a link, and the terminal of a new link has its mark.
bool ReplaceLink(const std::string& target, const std::string& path, int terminal) {
  const std::string fresh = path + ".new";
  if (unlink(fresh.c_str()) != 0 && errno != ENOENT) return false;
  return symlink(target.c_str(), fresh.c_str()) == 0 && WriteMark(terminal, MarkOfLink(fresh)) &&
         std::rename(fresh.c_str(), path.c_str()) == 0;
}

bool IsLinkOrAbsent(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::symlink_status(path, ignored);
  return status.type() == std::filesystem::file_type::not_found ||
         status.type() == std::filesystem::file_type::symlink;
}

}  // namespace

bool MakeRaw(int terminal) {
  termios2 mode{};
  if (ioctl(terminal, TCGETS2, &mode) != 0) return false;
  if (mode.c_lflag == 0 && mode.c_oflag == 0) return true;
  mode.c_iflag = 0;
  mode.c_oflag = 0;
  mode.c_lflag = 0;
  mode.c_cc[VMIN] = 1;
  mode.c_cc[VTIME] = 0;
  return ioctl(terminal, TCSETS2, &mode) == 0;
}

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

Result<> Pty::Open(const std::string& path) {
  Close();
  if (!IsLinkOrAbsent(path)) return Failure(path + " exists and is no link: remove it, or use another path");
  Descriptor master(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!master.valid()) return SystemFailure("cannot create a pty", "; is devpts mounted on /dev/pts?");
  std::array<char, 64> name{};
  if (grantpt(master.get()) != 0 || unlockpt(master.get()) != 0 ||
      ptsname_r(master.get(), name.data(), name.size()) != 0 || !MakeRaw(master.get())) {
    return SystemFailure("cannot set up the pty");
  }
  // Opened and closed once, so that HasHost also works before the first host.
  const Descriptor first_host(open(name.data(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!first_host.valid()) return SystemFailure(std::string("cannot open ") + name.data());
  if (!ReplaceLink(name.data(), path, master.get())) {
    return SystemFailure("cannot link " + path + " to " + name.data());
  }
  master_ = std::move(master);
  path_ = path;
  name_ = name.data();
  return {};
}

void Pty::Close() {
  if (!IsOpen()) return;
  std::error_code failed;
  // Another process may have replaced the link.
  const std::filesystem::path target = std::filesystem::read_symlink(path_, failed);
  if (!failed && target == name_) static_cast<void>(unlink(path_.c_str()));
  master_.Reset();
}

bool Pty::HasHost() const {
  pollfd wanted{master_.get(), 0, 0};
  return poll(&wanted, 1, 0) == 0;
}

std::size_t Pty::Read(std::span<std::uint8_t> into) {
  const ssize_t count = read(master_.get(), into.data(), into.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

bool Pty::Write(Bytes bytes) {
  return write(master_.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

void Pty::Discard() {
  if (!IsOpen()) return;
  // Flushed at the end of the host, because the master cannot reach what the line discipline holds.
  const Descriptor host_end(open(name_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (host_end.valid()) static_cast<void>(ioctl(host_end.get(), TCFLSH, TCIFLUSH));
}

std::int64_t Pty::Baud() const {
  // At the master, the kernel returns the mode of the other end.
  termios2 mode{};
  return ioctl(master_.get(), TCGETS2, &mode) == 0 ? std::int64_t{mode.c_ospeed} : 0;
}

}  // namespace axlecast
