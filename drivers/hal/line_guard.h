#pragma once

#include <sys/types.h>
#include <string>

#include "core/base/result.h"

namespace axlecast {

// Which pseudo-terminals the settings of a port allow.
struct PtyStatement {
  bool simulated = false;  // the path must be the link of an axlecast simulator
  bool foreign = false;    // the path may lead to a pty of another program, e.g. your own simulator (link.pty)
};

// Checks that a path leads to a line, and not to the terminal of a user, whose work a driver would destroy. All programs that
// open ports use it. Every error contains the reason and what to change.
//
// Call Before before the port is opened, because opening can already affect the line. Call After with the open port, before it
// is changed: an open terminal stays the same even if its path changes.
class LineGuard {
 public:
  LineGuard(std::string path, PtyStatement statement) : path_(std::move(path)), statement_(statement) {}

  [[nodiscard]] Result<> Before();
  [[nodiscard]] Result<> After(int line) const;

 private:
  [[nodiscard]] Result<> CheckPty(int line, dev_t file_system) const;

  std::string path_;
  PtyStatement statement_;
  dev_t device_ = 0;  // that Before has found
};

// Returns true if the path is a pty by its number, /dev/pts/N: an operator who types it means that terminal.
[[nodiscard]] bool IsPtyByNumber(const std::string& path);

// Documentation/admin-guide/devices.txt: the Unix98 pty slaves.
[[nodiscard]] bool IsPtyDevice(dev_t device);
// The same document: the virtual consoles, and /dev/tty, /dev/console and /dev/ptmx.
[[nodiscard]] bool IsConsoleDevice(dev_t device);

// Returns another process that has this device open, or that drives this CAN interface as its only master:
// "axlecast-tformat, process 4711". Returns no text if no such process is visible to this one (all are visible to root).
[[nodiscard]] std::string PortHolder(const std::string& port);

// The abstract name that the driver of a CAN interface binds, without the leading zero byte.
[[nodiscard]] std::string CanLockName(const std::string& interface);

}  // namespace axlecast
