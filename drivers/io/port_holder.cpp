#include "drivers/io/port_holder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <system_error>

namespace axlecast {
namespace {

namespace fs = std::filesystem;

// The number of the device behind a path; 0 when it is none.
dev_t DeviceBehind(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return 0;
  return status.st_rdev;
}

bool HasOpen(const fs::path& process, dev_t device) {
  std::error_code error;
  for (fs::directory_iterator file(process / "fd", error), end; !error && file != end; file.increment(error)) {
    if (DeviceBehind(file->path().string()) == device) return true;
  }
  return false;
}

bool IsProcess(const std::string& name) { return name.find_first_not_of("0123456789") == std::string::npos; }

}  // namespace

std::string PortHolder(const std::string& path) {
  const dev_t device = DeviceBehind(path);
  if (device == 0) return "";
  const std::string own = std::to_string(getpid());
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end; process.increment(error)) {
    const std::string id = process->path().filename().string();
    if (!IsProcess(id) || id == own || !HasOpen(process->path(), device)) continue;
    std::string name;
    std::getline(std::ifstream(process->path() / "comm"), name);
    return name + ", process " + id;
  }
  return "";
}

}  // namespace axlecast
