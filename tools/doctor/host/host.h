#pragma once

#include <sys/types.h>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// The state of a path from stat(2) and access(2). Links are followed.
struct HostFile {
  enum class Kind : std::uint8_t { kNone, kRegular, kFolder, kCharacter, kOther };

  std::string path;
  int error = 0;  // errno if stat(2) fails: ENOENT
  Kind kind = Kind::kNone;
  mode_t mode = 0;  // the twelve bits of chmod(1)
  uid_t uid = 0;
  gid_t gid = 0;
  std::string owner;  // a name; the number if it has no name
  std::string group;
  unsigned major = 0;  // kCharacter
  unsigned minor = 0;
  bool readable = false;  // for this process
  bool writable = false;
};

// A process that has a file open or locked.
struct HostProcess {
  pid_t id = 0;
  std::string name;                // /proc/PID/comm: at most 15 characters
  std::vector<std::string> words;  // its command line; empty if this user may not read it
};

// The files of the host below /proc, /sys, /dev and /etc. With a root folder, they are the files of another system or of a
// test.
class HostFiles {
 public:
  explicit HostFiles(std::string root = "") : root_(std::move(root)) {}

  // Returns the path that this process uses for the host's `path`.
  [[nodiscard]] std::string Place(const std::string& path) const { return root_ + path; }
  [[nodiscard]] HostFile Look(const std::string& path) const;
  // Returns at most 64 KiB, without the last newline; nothing if the file cannot be read.
  [[nodiscard]] std::optional<std::string> Text(const std::string& path) const;
  [[nodiscard]] std::optional<std::int64_t> Number(const std::string& path) const;
  // Returns the sorted names in a folder; none if it cannot be read.
  [[nodiscard]] std::vector<std::string> Names(const std::string& folder) const;

  // Returns all processes except this one.
  [[nodiscard]] std::vector<HostProcess> Processes() const;
  // Returns the processes that have a character device open or locked. Without root, only processes of this user and
  // those that lock it are found.
  [[nodiscard]] std::vector<HostProcess> Holders(const std::string& device) const;

 private:
  [[nodiscard]] HostProcess Process(pid_t id) const;
  [[nodiscard]] std::vector<pid_t> ProcessIds() const;

  std::string root_;
};

// Runs a line of sh(1) to its end; programs are found in PATH and /usr/sbin. Returns its output, at most 4 MiB. An exit
// code other than 0 is an error, with the output.
[[nodiscard]] Result<std::string> RunProgram(const std::string& line);

// Writes a value into an existing file of the kernel.
[[nodiscard]] Result<> WriteValue(const std::string& path, const std::string& value);

// Appends the line to a text file, unless the file contains it. Creates the file and its folder if they are missing.
[[nodiscard]] Result<> AppendLine(const std::string& path, const std::string& line);

// How this host would send to a multicast group. Nothing is sent.
struct MulticastRoute {
  int error = 0;          // errno if the kernel has no route: ENETUNREACH
  std::string interface;  // the outgoing interface; empty if unknown
};
[[nodiscard]] MulticastRoute FindMulticastRoute(const std::string& group);

struct LoopbackState {
  bool known = false;
  bool up = false;
  bool multicast = false;
};
[[nodiscard]] LoopbackState ReadLoopback();

// The limits of this process for ApplyRealtime (platform/os/process.h).
struct RealtimeLimits {
  std::int64_t priority = 0;      // maximum SCHED_FIFO priority (RLIMIT_RTPRIO); 99 for root
  std::int64_t locked_bytes = 0;  // of memory (RLIMIT_MEMLOCK); -1: unlimited
};
[[nodiscard]] RealtimeLimits ReadRealtimeLimits();

}  // namespace axlecast
