#include "platform/os/new_file.h"

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

// Sets who may use the file. The group is set before the mode, which gives it access.
Result<> Open(const Descriptor& file, const std::string& path, const FileAccess& access) {
  const uid_t owner = access.owner.value_or(static_cast<uid_t>(-1));  // -1: stays
  const gid_t group = access.group.value_or(static_cast<gid_t>(-1));
  if ((access.owner || access.group) && fchown(file.get(), owner, group) != 0) {
    return Failure(Problem(path) + ": only root, or a member of the group, can give it to the group");
  }
  if (fchmod(file.get(), access.mode) != 0) return Failure(Problem(path));
  return {};
}

// Gives the existing file its second name, durably: a power failure must not keep the replacement without it.
Result<> Keep(const std::string& path, const std::string& keep) {
  if (link(path.c_str(), keep.c_str()) != 0) return Failure(Problem(keep));
  if (const int error = SyncFolderOf(keep); error != 0) return Failure(keep + ": " + std::strerror(error));
  return {};
}

// Moves the complete file to its own name, durably.
Result<> Place(const std::string& fresh, const std::string& path, bool replace) {
  const int failed = replace ? std::rename(fresh.c_str(), path.c_str()) : link(fresh.c_str(), path.c_str());
  if (failed != 0 && errno == EEXIST) return Failure(path + " exists already, and is not replaced");
  if (failed != 0) return Failure(Problem(path));
  if (const int error = SyncFolderOf(path); error != 0) return Failure(path + ": " + std::strerror(error));
  return {};
}

}  // namespace

int SyncFolderOf(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const Descriptor directory(open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  return directory.valid() && fsync(directory.get()) == 0 ? 0 : errno;
}

NewFile::NewFile(std::string path, const FileAccess& access)
    : path_(std::move(path)), fresh_(path_ + ".XXXXXX"), file_(mkostemp(fresh_.data(), O_CLOEXEC)) {  // mode 0600
  state_ = file_.valid() ? Open(file_, path_, access) : Failure(Problem(path_));
}

NewFile::~NewFile() {
  if (file_.valid()) unlink(fresh_.c_str());  // already moved after Commit
}

Result<> NewFile::Append(std::string_view content) {
  if (state_ && !WriteAll(file_.get(), content)) state_ = Failure(Problem(path_));
  return state_;
}

bool NewFile::Collect(std::string_view piece) {
  constexpr std::size_t kTogether = 1U << 20;  // bytes
  collected_ += piece;
  if (collected_.size() >= kTogether) {
    state_ = Append(collected_);
    collected_.clear();
  }
  return state_.has_value();
}

void NewFile::Flush() {
  if (state_ && fdatasync(file_.get()) != 0) state_ = Failure(Problem(path_));
}

Result<> NewFile::Commit(bool replace, const std::string& keep) {
  state_ = Append(collected_);
  if (state_ && fsync(file_.get()) != 0) state_ = Failure(Problem(path_));
  if (state_ && !keep.empty()) state_ = Keep(path_, keep);
  if (state_) state_ = Place(fresh_, path_, replace);
  return state_;
}

Result<> WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access, bool replace) {
  NewFile file(path, access);
  const Result<> written = file.Append(content);
  return written ? file.Commit(replace) : written;
}

Result<> WriteOutput(const std::string& path, std::string_view content) {
  struct stat there {};
  const bool is_file = lstat(path.c_str(), &there) != 0 || S_ISREG(there.st_mode);
  if (is_file) return WriteNewFile(path, content, {.mode = 0644}, true);
  const Descriptor file(open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY));
  if (!file.valid() || !WriteAll(file.get(), content)) return Failure(Problem(path));
  return {};
}

std::optional<gid_t> FindGroup(const std::string& name) {
  const group* const found = getgrnam(name.c_str());
  return found == nullptr ? std::nullopt : std::optional(found->gr_gid);
}

}  // namespace axlecast
