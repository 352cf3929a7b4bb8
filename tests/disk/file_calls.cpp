// The file calls of the C library, for a program that links tests/disk: each calls the library's own, and records what it has
// changed. Shared libraries of the program (SQLite, libstdc++) use these too. Calls that the C library makes inside itself
// (fopen, for example) are not seen.
#include "tests/disk/file_calls.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace axlecast {
namespace {

// The library's own function of this name.
template <typename Function>
Function* Own(Function* /*of this type*/, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
#define AXLECAST_OWN(function) Own(&::function, #function)

bool Makes(int flags) { return (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE; }

// The path that a call of the ...at family names.
std::string PathAt(int folder, const char* path) {
  if (folder == AT_FDCWD || *path == '/') return path;
  const std::string link = "/proc/self/fd/" + std::to_string(folder);
  return std::filesystem::read_symlink(link).string() + '/' + path;
}

template <typename Call>
int Open(int folder, const char* path, int flags, mode_t mode, const Call& call) {
  if (FileCalls::TakePlantedFailure("open", path)) return -1;
  if (!FileCalls::Records()) return call();
  const FileCalls::Turn turn;
  const int file = call();
  const int error = errno;
  if (file >= 0) FileCalls::Opened(file, PathAt(folder, path), (flags & O_TRUNC) != 0, mode);
  errno = error;
  return file;
}

// Runs `call`, and `record` with its result if that is not -1.
template <typename Call, typename Then>
auto Recorded(const Call& call, const Then& record) {
  if (!FileCalls::Records()) return call();
  const FileCalls::Turn turn;
  const auto result = call();
  const int error = errno;
  if (result >= 0) record(result);
  errno = error;
  return result;
}

template <typename Call>
ssize_t WriteAtPosition(int file, const void* bytes, const Call& call) {
  return Recorded(call, [&](ssize_t size) {
    if (!FileCalls::Knows(file)) return;
    FileCalls::Wrote(file, lseek(file, 0, SEEK_CUR) - size, bytes, static_cast<std::size_t>(size));
  });
}

template <typename Own>
ssize_t WriteAt(int file, const void* bytes, std::size_t size, off_t offset, Own own) {
  if (FileCalls::TakePlantedFailure("pwrite", file)) return -1;
  if (const auto planted = FileCalls::TakePlantedWrite()) {
    if (*planted <= 0) return *planted;
    size = std::min(size, static_cast<std::size_t>(*planted));
  }
  return Recorded(
      [&] { return own(file, bytes, size, offset); },
      [&](ssize_t written) { FileCalls::Wrote(file, offset, bytes, static_cast<std::size_t>(written)); });
}

}  // namespace
}  // namespace axlecast

using axlecast::FileCalls;
using axlecast::Open;
using axlecast::Own;
using axlecast::Recorded;

#define AXLECAST_MODE()                                      \
  mode_t mode = 0;                                           \
  if (axlecast::Makes(flags)) {                              \
    va_list arguments;                                       \
    va_start(arguments, flags);                              \
    mode = static_cast<mode_t>(va_arg(arguments, unsigned)); \
    va_end(arguments);                                       \
  }

extern "C" {

#pragma GCC visibility push(default)

int open(const char* path, int flags, ...) {
  AXLECAST_MODE()
  static auto* const kOwn = AXLECAST_OWN(open);
  return Open(AT_FDCWD, path, flags, mode, [&] { return kOwn(path, flags, mode); });
}

int open64(const char* path, int flags, ...) {
  AXLECAST_MODE()
  static auto* const kOwn = AXLECAST_OWN(open64);
  return Open(AT_FDCWD, path, flags, mode, [&] { return kOwn(path, flags, mode); });
}

int openat(int folder, const char* path, int flags, ...) {
  AXLECAST_MODE()
  static auto* const kOwn = AXLECAST_OWN(openat);
  return Open(folder, path, flags, mode, [&] { return kOwn(folder, path, flags, mode); });
}

int openat64(int folder, const char* path, int flags, ...) {
  AXLECAST_MODE()
  static auto* const kOwn = AXLECAST_OWN(openat64);
  return Open(folder, path, flags, mode, [&] { return kOwn(folder, path, flags, mode); });
}

// What open becomes with _FORTIFY_SOURCE.
int __open_2(const char* path, int flags) { return open(path, flags); }
int __open64_2(const char* path, int flags) { return open64(path, flags); }
int __openat_2(int folder, const char* path, int flags) { return openat(folder, path, flags); }
int __openat64_2(int folder, const char* path, int flags) { return openat64(folder, path, flags); }

int creat(const char* path, mode_t mode) { return open(path, O_WRONLY | O_CREAT | O_TRUNC, mode); }
int creat64(const char* path, mode_t mode) { return open64(path, O_WRONLY | O_CREAT | O_TRUNC, mode); }

int mkostemp(char* path, int flags) {
  static auto* const kOwn = AXLECAST_OWN(mkostemp);
  return Open(AT_FDCWD, path, 0, 0600, [&] { return kOwn(path, flags); });
}

int mkstemp(char* path) { return mkostemp(path, 0); }

int close(int file) {
  static auto* const kOwn = AXLECAST_OWN(close);
  return Recorded([&] { return kOwn(file); }, [&](int) { FileCalls::Closed(file); });
}

ssize_t write(int file, const void* bytes, size_t size) {
  static auto* const kOwn = AXLECAST_OWN(write);
  return axlecast::WriteAtPosition(file, bytes, [&] { return kOwn(file, bytes, size); });
}

ssize_t writev(int file, const iovec* parts, int count) {
  static auto* const kOwn = AXLECAST_OWN(writev);
  std::string bytes;
  for (int i = 0; FileCalls::Records() && i < count; ++i)
    bytes.append(static_cast<const char*>(parts[i].iov_base), parts[i].iov_len);
  return axlecast::WriteAtPosition(file, bytes.data(), [&] { return kOwn(file, parts, count); });
}

ssize_t pwrite(int file, const void* bytes, size_t size, off_t offset) {
  static auto* const kOwn = AXLECAST_OWN(pwrite);
  return axlecast::WriteAt(file, bytes, size, offset, kOwn);
}

ssize_t pwrite64(int file, const void* bytes, size_t size, off64_t offset) {
  static auto* const kOwn = AXLECAST_OWN(pwrite64);
  return axlecast::WriteAt(file, bytes, size, offset, kOwn);
}

ssize_t pread(int file, void* bytes, size_t size, off_t offset) {
  static auto* const kOwn = AXLECAST_OWN(pread);
  return FileCalls::TakePlantedFailure("pread", file) ? -1 : kOwn(file, bytes, size, offset);
}

ssize_t pread64(int file, void* bytes, size_t size, off64_t offset) {
  static auto* const kOwn = AXLECAST_OWN(pread64);
  return FileCalls::TakePlantedFailure("pread", file) ? -1 : kOwn(file, bytes, size, offset);
}

int fstat(int file, struct stat* status) noexcept {
  static auto* const kOwn = Own(static_cast<int (*)(int, struct stat*)>(nullptr), "fstat");
  return FileCalls::TakePlantedFailure("fstat", file) ? -1 : kOwn(file, status);
}

// SQLite's locks.
int fcntl64(int file, int command, ...) {
  static auto* const kOwn = AXLECAST_OWN(fcntl64);
  va_list arguments;
  va_start(arguments, command);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  if (command == F_SETLK && FileCalls::TakePlantedFailure("fcntl", file)) return -1;
  return kOwn(file, command, argument);
}

int flock(int file, int operation) noexcept {
  static auto* const kOwn = AXLECAST_OWN(flock);
  return FileCalls::TakePlantedFailure("flock", file) ? -1 : kOwn(file, operation);
}

int ftruncate(int file, off_t size) noexcept {
  static auto* const kOwn = AXLECAST_OWN(ftruncate);
  return Recorded([&] { return kOwn(file, size); }, [&](int) { FileCalls::Resized(file, size); });
}

int ftruncate64(int file, off64_t size) noexcept {
  static auto* const kOwn = AXLECAST_OWN(ftruncate64);
  return Recorded([&] { return kOwn(file, size); }, [&](int) { FileCalls::Resized(file, size); });
}

int truncate(const char* path, off_t size) noexcept {
  static auto* const kOwn = AXLECAST_OWN(truncate);
  return Recorded([&] { return kOwn(path, size); }, [&](int) { FileCalls::ResizedPath(path, size); });
}

// Space behind the end of the file changes no byte and no size.
int fallocate(int file, int mode, off_t offset, off_t size) {
  static auto* const kOwn = AXLECAST_OWN(fallocate);
  return Recorded([&] { return kOwn(file, mode, offset, size); },
                  [&](int) {
                    if (mode == 0) FileCalls::Reserved(file, offset + size);
                  });
}

int posix_fallocate(int file, off_t offset, off_t size) {
  static auto* const kOwn = AXLECAST_OWN(posix_fallocate);
  return Recorded([&] { return kOwn(file, offset, size); },
                  [&](int error) {
                    if (error == 0) FileCalls::Reserved(file, offset + size);
                  });
}

int fsync(int file) {
  static auto* const kOwn = AXLECAST_OWN(fsync);
  return Recorded([&] { return kOwn(file); }, [&](int) { FileCalls::Synced(file, false); });
}

int fdatasync(int file) {
  static auto* const kOwn = AXLECAST_OWN(fdatasync);
  return Recorded([&] { return kOwn(file); }, [&](int) { FileCalls::Synced(file, true); });
}

// sync_file_range(2) makes nothing durable that a reader would find after a power cut, so it is not recorded.

int fchmod(int file, mode_t mode) noexcept {
  static auto* const kOwn = AXLECAST_OWN(fchmod);
  return Recorded([&] { return kOwn(file, mode); }, [&](int) { FileCalls::ChangedMode(file, mode); });
}

int chmod(const char* path, mode_t mode) noexcept {
  static auto* const kOwn = AXLECAST_OWN(chmod);
  return Recorded([&] { return kOwn(path, mode); }, [&](int) { FileCalls::ChangedModeOfPath(path, mode); });
}

int fchmodat(int folder, const char* path, mode_t mode, int flags) noexcept {
  static auto* const kOwn = AXLECAST_OWN(fchmodat);
  return Recorded([&] { return kOwn(folder, path, mode, flags); },
                  [&](int) { FileCalls::ChangedModeOfPath(axlecast::PathAt(folder, path), mode); });
}

int mkdir(const char* path, mode_t mode) noexcept {
  static auto* const kOwn = AXLECAST_OWN(mkdir);
  return Recorded([&] { return kOwn(path, mode); }, [&](int) { FileCalls::MadeFolder(path); });
}

int rmdir(const char* path) noexcept {
  static auto* const kOwn = AXLECAST_OWN(rmdir);
  return Recorded([&] { return kOwn(path); }, [&](int) { FileCalls::Removed(path); });
}

int unlink(const char* path) noexcept {
  static auto* const kOwn = AXLECAST_OWN(unlink);
  return Recorded([&] { return kOwn(path); }, [&](int) { FileCalls::Removed(path); });
}

int unlinkat(int folder, const char* path, int flags) noexcept {
  static auto* const kOwn = AXLECAST_OWN(unlinkat);
  return Recorded([&] { return kOwn(folder, path, flags); },
                  [&](int) { FileCalls::Removed(axlecast::PathAt(folder, path)); });
}

int remove(const char* path) noexcept {
  static auto* const kOwn = Own(static_cast<int (*)(const char*)>(nullptr), "remove");
  return Recorded([&] { return kOwn(path); }, [&](int) { FileCalls::Removed(path); });
}

int link(const char* from, const char* to) noexcept {
  static auto* const kOwn = AXLECAST_OWN(link);
  return Recorded([&] { return kOwn(from, to); }, [&](int) { FileCalls::Linked(from, to); });
}

int rename(const char* from, const char* to) noexcept {
  static auto* const kOwn = AXLECAST_OWN(rename);
  return Recorded([&] { return kOwn(from, to); }, [&](int) { FileCalls::Moved(from, to); });
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  static auto* const kOwn = AXLECAST_OWN(renameat);
  return Recorded(
      [&] { return kOwn(from_folder, from, to_folder, to); },
      [&](int) { FileCalls::Moved(axlecast::PathAt(from_folder, from), axlecast::PathAt(to_folder, to)); });
}

#pragma GCC visibility pop

}  // extern "C"
