#include "platform/os/mapped_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

std::string Remedy(int error) {
  switch (error) {
    case EACCES:
      return ": it takes the right to read it";
    case EMFILE:
      return ": give fewer files at a time, or raise `ulimit -n`";
    case ENOENT:
      return ": check its name";
    default:
      return "";
  }
}

}  // namespace

MappedFile::MappedFile(const std::string& path) : path_(path) { Open(); }

FileAccess MappedFile::access() const {
  FileAccess access{.mode = mode_};
  if (geteuid() == 0) {
    access.owner = owner_;
    access.group = group_;
  }
  return access;
}

void MappedFile::Open() {
  // A pipe without a writer would block the open.
  Descriptor file(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file.valid() || fstat(file.get(), &status) != 0) {
    const int error = errno;
    problem_ = path_ + ": " + std::strerror(error) + Remedy(error);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    problem_ =
        path_ + (S_ISDIR(status.st_mode) ? " is a folder, not a file" : " is no regular file: copy it to one");
    return;
  }
  mode_ = status.st_mode & 0777U;
  owner_ = status.st_uid;
  group_ = status.st_gid;
  if (status.st_size == 0) return;
  region_ = std::make_unique<MappedRegion>(std::move(file), static_cast<std::size_t>(status.st_size));
  if (const int error = region_->error(); error != 0) {
    problem_ = path_ + ": " + std::strerror(error) + Remedy(error);
    region_.reset();
  }
}

std::string MappedFile::Loss() const {
  if (region_ == nullptr) return "";
  const std::size_t size = region_->bytes().size();
  if (const std::size_t left = region_->Left(); left < size) {
    return path_ + " was made shorter while it was read: of its " + std::to_string(size) + " bytes " +
           std::to_string(left) + " are left";
  }
  if (!region_->fell()) return "";
  return path_ + " could not be read everywhere: it was written anew meanwhile, or its disk is defective";
}

}  // namespace axlecast
