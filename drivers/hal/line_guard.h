#pragma once

#include <sys/types.h>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// What the settings of a port say about pseudo-terminals.
struct PtyStatement {
  bool simulated = false;  // the path is the link of one of our simulators: nothing else may be behind it
  bool foreign = false;    // the path may lead to a pty of another program, e.g. a simulator of yours (link.pty)
};

// No driver may take a terminal that is not its line: to set it up and to write requests into it destroys what its user
// does there. The one check of all programs that open ports; every text names the reason and what to change.
//
// `Before` is asked before the port is opened, because to open a port can already act on the line. `After` is asked
// with the port open and before anything is changed: an open terminal stays the same, whatever happens to its path.
class LineGuard {
 public:
  LineGuard(std::string path, PtyStatement statement) : path_(std::move(path)), statement_(statement) {}

  [[nodiscard]] Result<> Before();
  [[nodiscard]] Result<> After(int line) const;

 private:
  [[nodiscard]] Result<> CheckPty(int line, dev_t file_system) const;

  std::string path_;
  PtyStatement statement_;
  dev_t judged_ = 0;
};

// Whether the path is a pty by its number, /dev/pts/N. Somebody who types it for one run means that very terminal.
[[nodiscard]] bool IsPtyByNumber(const std::string& path);

// Documentation/admin-guide/devices.txt: the Unix98 pty slaves.
[[nodiscard]] bool IsPtyDevice(dev_t device);
// From there too: the virtual consoles, and /dev/tty, /dev/console and /dev/ptmx.
[[nodiscard]] bool IsConsoleDevice(dev_t device);

// Returns another process that has this device open, or that drives this CAN interface as its only master:
// "axlecast-tformat, process 4711". Empty when there is none, or none that this process may see (root sees all).
[[nodiscard]] std::string PortHolder(const std::string& port);

// The abstract name that the driver of a CAN interface binds, without the leading zero byte.
[[nodiscard]] std::string CanLockName(const std::string& interface);

}  // namespace axlecast
