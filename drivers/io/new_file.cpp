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
#include <utility>

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

// Who may use it, and its content on disk.
std::string Settle(const Descriptor& file, const std::string& path, const FileAccess& access) {
  // The group first: the mode opens the file to it.
  if (access.group && fchown(file.get(), static_cast<uid_t>(-1), *access.group) != 0) {
    return Problem(path) + ": only root, or a member of the group, can give it to the group";
  }
  if (fchmod(file.get(), access.mode) != 0 || fsync(file.get()) != 0) return Problem(path);
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

NewFile::NewFile(std::string path, const FileAccess& access, bool replace)
    : path_(std::move(path)), fresh_(path_ + ".XXXXXX"), access_(access), replace_(replace) {
  file_ = Descriptor(mkostemp(fresh_.data(), O_CLOEXEC));  // O_EXCL, mode 0600
  if (!file_.valid()) problem_ = Problem(path_);
}

NewFile::~NewFile() {
  if (file_.valid()) unlink(fresh_.c_str());  // gone already where it was renamed
}

bool NewFile::Write(std::string_view content) {
  constexpr std::size_t kWaiting = 1U << 16;  // bytes for one write
  waiting_ += content;
  return problem_.empty() && (waiting_.size() < kWaiting || Flush());
}

bool NewFile::Flush() {
  if (!WriteAll(file_.get(), waiting_)) problem_ = Problem(path_);
  waiting_.clear();
  return problem_.empty();
}

std::string NewFile::Keep() {
  if (problem_.empty() && Flush()) problem_ = Settle(file_, path_, access_);
  if (problem_.empty()) problem_ = Place(fresh_, path_, replace_);
  return problem_;
}

std::string WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                         bool replace) {
  NewFile file(path, access, replace);
  static_cast<void>(file.Write(content));
  return file.Keep();
}

std::optional<gid_t> FindGroup(const std::string& name) {
  const group* const found = getgrnam(name.c_str());
  return found == nullptr ? std::nullopt : std::optional(found->gr_gid);
}

}  // namespace axlecast
