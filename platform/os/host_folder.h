#pragma once

#include <cstdint>
#include <string>

namespace axlecast {

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

}  // namespace axlecast
