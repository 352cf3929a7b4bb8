#include "drivers/io/new_file.h"

#include <fcntl.h>
#include <grp.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "drivers/io/descriptor.h"

namespace axlecast {
namespace {

std::string Problem(const std::string& path) { return path + ": " + std::strerror(errno); }

bool WriteAll(int fd, std::string_view content) {
  while (!content.empty()) {
    const ssize_t count = write(fd, content.data(), content.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    content.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

// The content, and who may use it, on disk.
std::string Fill(const Descriptor& file, const std::string& path, std::string_view content,
                 const FileAccess& access) {
  // The group first: the mode opens the file to it.
  if (access.group && fchown(file.get(), static_cast<uid_t>(-1), *access.group) != 0) {
    return Problem(path) + ": only root, or a member of the group, can give it to the group";
  }
  if (fchmod(file.get(), access.mode) != 0 || !WriteAll(file.get(), content) || fsync(file.get()) != 0) {
    return Problem(path);
  }
  return "";
}

// The complete file under its own name, which lasts.
std::string Place(const std::string& fresh, const std::string& path, bool replace) {
  const int failed = replace ? std::rename(fresh.c_str(), path.c_str()) : link(fresh.c_str(), path.c_str());
  if (failed != 0 && errno == EEXIST) return path + " exists already, and is not replaced";
  if (failed != 0) return Problem(path);
  std::string folder = std::filesystem::path(path).parent_path().string();
  if (folder.empty()) folder = ".";
  const Descriptor directory(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!directory.valid() || fsync(directory.get()) != 0) return Problem(folder);
  return "";
}

}  // namespace

std::string WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                         bool replace) {
  std::string fresh = path + ".XXXXXX";
  const Descriptor file(mkostemp(fresh.data(), O_CLOEXEC));  // O_EXCL, mode 0600
  if (!file.valid()) return Problem(path);
  std::string problem = Fill(file, path, content, access);
  if (problem.empty()) problem = Place(fresh, path, replace);
  unlink(fresh.c_str());  // gone already where it was renamed
  return problem;
}

std::optional<gid_t> FindGroup(const std::string& name) {
  const group* const found = getgrnam(name.c_str());
  return found == nullptr ? std::nullopt : std::optional(found->gr_gid);
}

}  // namespace axlecast
