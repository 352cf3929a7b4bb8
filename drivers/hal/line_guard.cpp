#include "drivers/hal/line_guard.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "drivers/hal/pty.h"

namespace axlecast {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kFirstPtyMajor = 136;
constexpr unsigned kLastPtyMajor = 143;
constexpr unsigned kConsoleMajor = 4;  // its first 64 minors are the virtual consoles, the others serial ports
constexpr unsigned kFirstSerialMinor = 64;
constexpr unsigned kOwnTerminalMajor = 5;  // /dev/tty, /dev/console, /dev/ptmx, then serial ports from 64 on

bool IsProcess(const std::string& name) { return name.find_first_not_of("0123456789") == std::string::npos; }

// proc(5), /proc/[pid]/stat: the seventh field, with the minor number in the bits 31 to 20 and 7 to 0.
dev_t ControllingTerminal(const std::string& stat_line) {
  const std::size_t name_end = stat_line.rfind(')');  // a name can hold blanks and brackets
  if (name_end == std::string::npos) return 0;
  std::istringstream rest(stat_line.substr(name_end + 1));
  std::string state;
  int parent = 0, group = 0, session = 0, terminal = 0;
  if (!(rest >> state >> parent >> group >> session >> terminal)) return 0;
  const auto number = static_cast<unsigned>(terminal);
  return number == 0 ? 0 : makedev((number >> 8U) & 0xFFFU, (number & 0xFFU) | ((number >> 12U) & 0xFFF00U));
}

// Returns true if the process has other ptys (in a container). A process that cannot be inspected is assumed to have the same.
bool HasOtherPtys(const fs::path& process, dev_t terminal, dev_t file_system) {
  if (file_system == 0) return false;
  struct stat status {};
  const fs::path node = process / "root/dev/pts" / std::to_string(minor(terminal));
  return stat(node.c_str(), &status) == 0 && status.st_dev != file_system;
}

// Returns the first process for which has(folder of the process in /proc) is true: "bash, process 4711"; no text without
// such a process. Processes of the same user are always visible, processes of another process namespace never.
template <typename Has>
std::string FindProcess(const Has& has) {
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end; process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (!IsProcess(id) || !has(process->path())) continue;
    std::string name;
    std::getline(std::ifstream(process->path() / "comm"), name);
    return name + ", process " + id;
  }
  return "";
}

// Returns a process whose controlling terminal is `terminal`. `file_system` is that of the node of a pseudo-terminal, because
// each container can have its own ptys with the same numbers; 0: any.
std::string SessionOn(dev_t terminal, dev_t file_system) {
  return FindProcess([&](const fs::path& process) {
    std::string line;
    std::getline(std::ifstream(process / "stat"), line);
    return ControllingTerminal(line) == terminal && !HasOtherPtys(process, terminal, file_system);
  });
}

// Refuses the terminal of a session; `who` is empty without a session.
Result<> RefuseSession(const std::string& path, const std::string& who) {
  if (who.empty()) return {};
  return Failure(path + " is the terminal that " + who +
                 " works at, and no line to a device: correct link.port (of a serial port with a login: sudo "
                 "systemctl disable --now serial-getty@PORT)");
}

// Returns the number of the device behind a path; 0 if it is not a device.
dev_t DeviceBehind(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return 0;
  return status.st_rdev;
}

// proc(5), /proc/net/unix: "0000000000000000: 00000002 00000000 00000000 0002 01 12345 @axlecast-can/can0". Returns the target
// of the link in /proc/PID/fd for this socket; no text if the name is not bound.
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

// Returns another process that has a file open for which is(path in /proc/PID/fd) is true.
template <typename Is>
std::string FindHolder(const Is& is) {
  const std::string own = std::to_string(getpid());
  return FindProcess([&](const fs::path& process) {
    if (process.filename() == own) return false;
    std::error_code error;
    for (fs::directory_iterator file(process / "fd", error), end; !error && file != end; file.increment(error)) {
      if (is(file->path())) return true;
    }
    return false;
  });
}

}  // namespace

bool IsPtyDevice(dev_t device) { return major(device) >= kFirstPtyMajor && major(device) <= kLastPtyMajor; }

bool IsConsoleDevice(dev_t device) {
  const unsigned number = major(device);
  return (number == kConsoleMajor || number == kOwnTerminalMajor) && minor(device) < kFirstSerialMinor;
}

bool IsPtyByNumber(const std::string& path) { return path.starts_with("/dev/pts/"); }

Result<> LineGuard::Before() {
  device_ = 0;
  struct stat status {};
  if (stat(path_.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return {};  // open(2) reports why
  device_ = status.st_rdev;
  if (IsPtyDevice(device_)) return {};
  if (IsConsoleDevice(device_)) return Failure(path_ + " is a console and no serial port: correct link.port");
  return RefuseSession(path_, SessionOn(device_, 0));
}

Result<> LineGuard::After(int line) const {
  struct stat status {};
  if (fstat(line, &status) != 0 || status.st_rdev != device_) {
    return Failure(path_ + " led to another device while it was opened: open it again");
  }
  if (IsPtyDevice(device_)) return CheckPty(line, status.st_dev);
  if (!statement_.simulated) return {};
  return Failure(path_ + " is not the line of a simulator: start it with `axlecast simulate`");
}

Result<> LineGuard::CheckPty(int line, dev_t file_system) const {
  const std::uint64_t mark = ReadMark(line);
  if (mark != 0 && mark == MarkOfLink(path_)) return {};
  if (statement_.simulated || !statement_.foreign) {
    const std::string terminal = "/dev/pts/" + std::to_string(minor(device_));
    std::string text = path_ + (path_ == terminal ? " is a pseudo-terminal" : " leads to " + terminal) +
                       " that no simulator of ours made for it; start the simulator (`axlecast simulate`)";
    if (!statement_.simulated) text += ", or set `pty: true` in `link` if another program simulates the device";
    return Failure(text);
  }
  return RefuseSession(path_, SessionOn(device_, file_system));
}

std::string CanLockName(const std::string& interface) { return "axlecast-can/" + interface; }

std::string PortHolder(const std::string& port) {
  if (const dev_t device = DeviceBehind(port); device != 0) {
    return FindHolder([device](const fs::path& file) { return DeviceBehind(file.string()) == device; });
  }
  const std::string socket = SocketBoundTo(CanLockName(port));
  if (socket.empty()) return "";
  return FindHolder([&socket](const fs::path& file) {
    std::error_code gone;
    return fs::read_symlink(file, gone) == socket;
  });
}

}  // namespace axlecast
