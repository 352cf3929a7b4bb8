#include "platform/os/log_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>

#include "platform/os/new_file.h"

namespace axlecast {
namespace {

constexpr std::int64_t kReserve = 16 << 20;  // bytes
constexpr mode_t kMode = 0644;

// On a file system without locks, the file counts as not locked.
bool IsLocked(const Descriptor& file) { return flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK; }

}  // namespace

int LogFile::Create(const std::string& path) {
  Descriptor file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode));
  if (!file.valid()) return errno;
  if (IsLocked(file)) return EBUSY;
  *this = LogFile();
  file_ = std::move(file);
  path_ = path;
  return 0;
}

int LogFile::Continue(const std::string& path, std::int64_t size) {
  Descriptor file(open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (!file.valid()) return errno;
  if (IsLocked(file)) return EBUSY;
  *this = LogFile();
  file_ = std::move(file);
  path_ = path;  // its name may not be durable: the process that created it may have been killed
  return CutTo(size);
}

bool LogFile::IsBeingWritten(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return file.valid() && IsLocked(file);
}

int LogFile::Write(Bytes& bytes) {
  Reserve(static_cast<std::int64_t>(bytes.size()));
  while (!bytes.empty()) {
    const ssize_t count = pwrite(file_.get(), bytes.data(), bytes.size(), size_);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    if (count == 0) return EIO;
    size_ += count;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return 0;
}

// Not every file system supports this. Then the write fails if there is no space.
void LogFile::Reserve(std::int64_t bytes) {
  if (size_ + bytes <= reserved_) return;
  reserved_ = size_ + bytes + kReserve;
  static_cast<void>(fallocate(file_.get(), FALLOC_FL_KEEP_SIZE, size_, reserved_ - size_));
}

int LogFile::CutTo(std::int64_t size) {
  if (ftruncate(file_.get(), size) != 0) return errno;
  size_ = size;
  reserved_ = size;
  return 0;
}

int LogFile::Sync() {
  if (fdatasync(file_.get()) != 0) return errno;
  if (name_is_durable_) return 0;
  const int result = SyncFolderOf(path_);
  name_is_durable_ = result == 0;
  return result;
}

int LogFile::Close() {
  // Truncating a file to its own size releases the space behind its end.
  const int cut = CutTo(size_);
  const int synced = Sync();
  file_.Reset();
  return cut != 0 ? cut : synced;
}

std::int64_t LogFile::FreeBytes() const {
  struct statvfs disk {};
  if (fstatvfs(file_.get(), &disk) != 0) return -1;
  return static_cast<std::int64_t>(disk.f_bavail * disk.f_frsize);
}

}  // namespace axlecast
