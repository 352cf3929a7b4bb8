#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// What stat(2) and access(2) tell of a path; links are followed.
struct HostFile {
  enum class Kind : std::uint8_t { kNone, kRegular, kFolder, kCharacter, kOther };

  std::string path;
  int error = 0;  // errno where it cannot be looked at: ENOENT
  Kind kind = Kind::kNone;
  mode_t mode = 0;  // the twelve bits of chmod(1)
  uid_t uid = 0;
  gid_t gid = 0;
  std::string owner;  // names, or numbers that have none
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
  std::vector<std::string> words;  // its command line; empty where that is not ours to see
};

// The host's /proc, /sys, /dev and /etc as files. Below a root folder they are another system's, or a test's.
class HostFiles {
 public:
  explicit HostFiles(std::string root = "") : root_(std::move(root)) {}

  // Where the host's `path` is for this process.
  [[nodiscard]] std::string Place(const std::string& path) const { return root_ + path; }
  [[nodiscard]] HostFile Look(const std::string& path) const;
  // Without the last newline; at most 64 KiB. Nothing where it cannot be read.
  [[nodiscard]] std::optional<std::string> Text(const std::string& path) const;
  [[nodiscard]] std::optional<std::int64_t> Number(const std::string& path) const;
  // Names in a folder, in their order; none where there is none.
  [[nodiscard]] std::vector<std::string> Names(const std::string& folder) const;

  // Processes, and of these the ones that hold a character device open, or lock it. Without rights only the processes
  // of this user, and those that lock it, are seen. This process is left out.
  [[nodiscard]] std::vector<HostProcess> Processes() const;
  [[nodiscard]] std::vector<HostProcess> Holders(const std::string& device) const;

 private:
  [[nodiscard]] HostProcess Process(pid_t id) const;
  [[nodiscard]] std::vector<pid_t> ProcessIds() const;

  std::string root_;
};

}  // namespace axlecast
