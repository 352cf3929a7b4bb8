// For LD_PRELOAD: a disk that fails as the file $AXLECAST_DISK_FAULT specifies, with EIO, for logs (*.lcm) only. "write":
// half of what is written arrives, and the rest is refused; "sync": nothing is brought to the disk; empty: it is well.

#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string>

namespace {

bool Fails(const std::string& what, int file) {
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(file);
  if (readlink(link.c_str(), path.data(), path.size() - 1) < 0) return false;
  if (!std::string(path.data()).ends_with(".lcm")) return false;
  const char* fault = std::getenv("AXLECAST_DISK_FAULT");
  std::string word;
  return fault != nullptr && (std::ifstream(fault) >> word) && word == what;
}

template <typename Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int Refuse() {
  errno = EIO;
  return -1;
}

ssize_t Write(int file, const void* bytes, std::size_t size, off_t offset) {
  static const auto kReal = Real<ssize_t(int, const void*, std::size_t, off_t)>("pwrite");
  static bool half_written = false;  // one thread writes
  if (!Fails("write", file)) return kReal(file, bytes, size, offset);
  half_written = !half_written;
  return half_written && size > 1 ? kReal(file, bytes, size / 2, offset) : Refuse();
}

}  // namespace

extern "C" {

ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t offset) {
  return Write(file, bytes, size, offset);
}

ssize_t pwrite64(int file, const void* bytes, std::size_t size, off_t offset) {
  return Write(file, bytes, size, offset);
}

int fdatasync(int file) {
  static const auto kReal = Real<int(int)>("fdatasync");
  return Fails("sync", file) ? Refuse() : kReal(file);
}

}  // extern "C"
