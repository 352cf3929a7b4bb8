#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "platform/os/descriptor.h"

namespace axlecast {

// Makes `path` a directory that only this user can use (0700, its parents where they are missing). An empty string
// when it is one, else the cause and the remedy: in /tmp somebody else may have put a directory or a link there.
[[nodiscard]] std::string PrepareRunDirectory(const std::string& path);

// A lock that ends with the process, however it ends.
class LockFile {
 public:
  // An empty string when the lock is ours, else who holds it (its process id).
  [[nodiscard]] std::string Acquire(const std::string& path);
  // The process that holds it; 0 when none does.
  [[nodiscard]] static pid_t Holder(const std::string& path);
  void Release() { file_.Reset(); }

 private:
  Descriptor file_;
};

// A folder that a process of the machine writes into, or would make.
struct HostFolder {
  std::string path;
  std::string existing;         // itself, or the nearest folder above it that is there
  bool is_folder = false;       // `existing` is one
  bool writable = false;        // `existing`, for this process
  std::string file_system;      // tmpfs, nfs, vfat, ...; empty: one that nothing is to be said about
  std::int64_t free_bytes = 0;  // for an unprivileged process
};
[[nodiscard]] HostFolder LookAtFolder(const std::string& path);

// Returns an empty string if no other user decides where `path` leads: each symbolic link on its way, the last name
// included, belongs to this user or to root. Otherwise the problem and its remedy. What does not exist yet is no link.
[[nodiscard]] std::string ForeignLinkProblem(const std::string& path);

}  // namespace axlecast
