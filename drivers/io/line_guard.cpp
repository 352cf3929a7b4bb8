#include "drivers/io/line_guard.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include "drivers/io/pty_mark.h"
#include "drivers/io/terminal_session.h"

namespace axlecast {
namespace {

constexpr unsigned kFirstPtyMajor = 136;
constexpr unsigned kLastPtyMajor = 143;
constexpr unsigned kConsoleMajor = 4;  // its first 64 minors are the virtual consoles, the others serial ports
constexpr unsigned kFirstSerialMinor = 64;
constexpr unsigned kOwnTerminalMajor = 5;  // /dev/tty, /dev/console, /dev/ptmx, then serial ports from 64 on

bool IsConsole(dev_t device) {
  const unsigned number = major(device);
  return (number == kConsoleMajor || number == kOwnTerminalMajor) && minor(device) < kFirstSerialMinor;
}

std::string PersonsTerminal(const std::string& path, const std::string& who) {
  return path + " is the terminal that " + who +
         " works at, and no line to a device: correct link.port (of a serial port with a login: sudo systemctl "
         "disable --now serial-getty@PORT)";
}

}  // namespace

bool IsPtyDevice(dev_t device) { return major(device) >= kFirstPtyMajor && major(device) <= kLastPtyMajor; }

bool IsPtyByNumber(const std::string& path) { return path.starts_with("/dev/pts/"); }

std::string LineGuard::Before() {
  judged_ = 0;
  struct stat status {};
  if (stat(path_.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return "";  // the open tells why
  judged_ = status.st_rdev;
  if (IsPtyDevice(judged_)) return "";
  if (IsConsole(judged_)) return path_ + " is a console and no serial port: correct link.port";
  const std::string who = SessionOn(judged_, 0);
  return who.empty() ? "" : PersonsTerminal(path_, who);
}

std::string LineGuard::After(int line) const {
  struct stat status {};
  if (fstat(line, &status) != 0 || status.st_rdev != judged_) {
    return path_ + " led to another device while it was opened: open it again";
  }
  if (IsPtyDevice(judged_)) return JudgePty(line, status.st_dev);
  if (!statement_.simulated) return "";
  return path_ + " is not the line of a simulator: start it with `axlecast simulate`";
}

std::string LineGuard::JudgePty(int line, dev_t file_system) const {
  const std::uint64_t mark = ReadMark(line);
  if (mark != 0 && mark == MarkOfLink(path_)) return "";
  if (statement_.simulated || !statement_.foreign) {
    const std::string terminal = "/dev/pts/" + std::to_string(minor(judged_));
    std::string text = path_ + (path_ == terminal ? " is a pseudo-terminal" : " leads to " + terminal) +
                       " that no simulator of ours made for it; start the simulator (`axlecast simulate`)";
    if (!statement_.simulated) text += ", or say `pty: true` in `link` if another program stands for the device";
    return text;
  }
  const std::string who = SessionOn(judged_, file_system);
  return who.empty() ? "" : PersonsTerminal(path_, who);
}

}  // namespace axlecast
