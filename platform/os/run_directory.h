#pragma once

#include <sys/types.h>

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

}  // namespace axlecast
