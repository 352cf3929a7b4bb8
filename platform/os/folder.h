#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Makes `path` a directory that only this user can use (mode 0700), and its parents if they are missing. Fails if another
// user has put a directory or a link there, which is possible in /tmp.
[[nodiscard]] Result<> PrepareRunDirectory(const std::string& path);

// Creates a folder and those above it that are missing, with these permissions, durably: a power failure cannot take the
// folder, and so its files, away. This includes folders that an earlier process of this user has created, which may have been
// killed before it synced them. Returns the errno and sets `failed` to the folder that cannot be created; 0 means success.
[[nodiscard]] int MakeFolders(const std::string& path, mode_t mode, std::string& failed);
// The same, with the error as text.
[[nodiscard]] Result<> MakeFolders(const std::string& path, mode_t mode);

// A lock that ends with the process, however it ends.
class LockFile {
 public:
  // Takes the lock. The error names the process that holds it.
  [[nodiscard]] Result<> Acquire(const std::string& path);
  // Returns the process that holds the lock; 0 if no process holds it.
  [[nodiscard]] static pid_t Holder(const std::string& path);
  void Release() { file_.Reset(); }

 private:
  Descriptor file_;
};

// A folder that a process of the machine writes to, or would create.
struct HostFolder {
  std::string path;
  std::string existing;         // itself, or the nearest existing folder above it
  bool is_folder = false;       // `existing` is one
  bool writable = false;        // `existing`, for this process
  std::string file_system;      // tmpfs, nfs, vfat, ...; empty: any other
  std::int64_t free_bytes = 0;  // for an unprivileged process
};
[[nodiscard]] HostFolder LookAtFolder(const std::string& path);

// Fails if another user decides where `path` leads: each symbolic link in the path, the last name included, must belong to
// this user or to root. A name that does not exist yet is accepted.
[[nodiscard]] Result<> CheckLinks(const std::string& path);

}  // namespace axlecast
