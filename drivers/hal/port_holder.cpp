#include "drivers/hal/port_holder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

namespace axlecast {
namespace {

namespace fs = std::filesystem;

// The number of the device behind a path; 0 when it is none.
dev_t DeviceBehind(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return 0;
  return status.st_rdev;
}

bool HasOpen(const fs::path& process, dev_t device) {
  std::error_code error;
  for (fs::directory_iterator file(process / "fd", error), end; !error && file != end; file.increment(error)) {
    if (DeviceBehind(file->path().string()) == device) return true;
  }
  return false;
}

// proc(5), /proc/net/unix: "0000000000000000: 00000002 00000000 00000000 0002 01 12345 @axlecast-can/can0". What /proc/PID/fd
// leads to for this socket; empty when nobody has bound the name.
std::string SocketBoundTo(const std::string& name) {
  std::ifstream sockets("/proc/net/unix");
  for (std::string line; std::getline(sockets, line);) {
    std::istringstream words(line);
    std::string number, references, protocol, flags, type, state, inode, bound;
    if (!(words >> number >> references >> protocol >> flags >> type >> state >> inode >> bound)) continue;
    if (bound == '@' + name) return "socket:[" + inode + ']';
  }
  return "";
}

bool HasSocket(const fs::path& process, const std::string& socket) {
  std::error_code error;
  for (fs::directory_iterator file(process / "fd", error), end; !error && file != end; file.increment(error)) {
    std::error_code gone;
    if (fs::read_symlink(file->path(), gone) == socket) return true;
  }
  return false;
}

bool IsProcess(const std::string& name) { return name.find_first_not_of("0123456789") == std::string::npos; }

// "comm, process 4711" of the first other process for which `has` is true.
template <typename Has>
std::string FindHolder(const Has& has) {
  const std::string own = std::to_string(getpid());
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end; process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (!IsProcess(id) || id == own || !has(process->path())) continue;
    std::string name;
    std::getline(std::ifstream(process->path() / "comm"), name);
    return name + ", process " + id;
  }
  return "";
}

}  // namespace

std::string CanLockName(const std::string& interface) { return "axlecast-can/" + interface; }

std::string PortHolder(const std::string& port) {
  if (const dev_t device = DeviceBehind(port); device != 0) {
    return FindHolder([device](const fs::path& process) { return HasOpen(process, device); });
  }
  const std::string socket = SocketBoundTo(CanLockName(port));
  if (socket.empty()) return "";
  return FindHolder([&socket](const fs::path& process) { return HasSocket(process, socket); });
}

}  // namespace axlecast
