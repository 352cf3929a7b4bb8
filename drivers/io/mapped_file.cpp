#include "drivers/io/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "drivers/io/descriptor.h"

namespace axlecast {
namespace {

std::string Remedy(int error) {
  switch (error) {
    case EACCES:
      return ": it takes the right to read it";
    case ENOENT:
      return ": check its name";
    default:
      return "";
  }
}

}  // namespace

MappedFile::MappedFile(const std::string& path) { Open(path); }

MappedFile::~MappedFile() {
  if (data_ != nullptr) munmap(const_cast<std::uint8_t*>(data_), size_);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : data_(std::exchange(other.data_, nullptr)),
      size_(std::exchange(other.size_, 0)),
      mode_(other.mode_),
      owner_(other.owner_),
      group_(other.group_),
      problem_(std::move(other.problem_)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  std::swap(mode_, other.mode_);
  std::swap(owner_, other.owner_);
  std::swap(group_, other.group_);
  std::swap(problem_, other.problem_);
  return *this;
}

FileAccess MappedFile::access() const {
  FileAccess access{.mode = mode_};
  if (geteuid() == 0) {
    access.owner = owner_;
    access.group = group_;
  }
  return access;
}

void MappedFile::Open(const std::string& path) {
  // A pipe without a writer would block the open.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!file.valid() || fstat(file.get(), &status) != 0) {
    const int error = errno;
    problem_ = path + ": " + std::strerror(error) + Remedy(error);
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    problem_ =
        path + (S_ISDIR(status.st_mode) ? " is a folder, not a file" : " is no regular file: copy it to one");
    return;
  }
  mode_ = status.st_mode & 0777U;
  owner_ = status.st_uid;
  group_ = status.st_gid;
  if (status.st_size == 0) return;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* const data = mmap(nullptr, size, PROT_READ, MAP_SHARED, file.get(), 0);
  if (data == MAP_FAILED) {
    problem_ = path + ": " + std::strerror(errno);
    return;
  }
  data_ = static_cast<const std::uint8_t*>(data);
  size_ = size;
  static_cast<void>(madvise(data, size, MADV_SEQUENTIAL));  // a hint
}

}  // namespace axlecast
