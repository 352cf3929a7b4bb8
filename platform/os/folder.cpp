#include "platform/os/folder.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <list>
#include <system_error>

#include "platform/os/new_file.h"

namespace axlecast {
namespace {

constexpr const char* kElsewhere = "; remove it, or set AXLECAST_RUN_DIR to another directory";

std::string Problem(const std::string& path) { return path + ": " + std::strerror(errno) + kElsewhere; }

bool OthersMayWrite(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 && (status.st_mode & S_IWOTH) != 0;
}

// In a folder where others may write, a directory must belong to this user or root, and must not be a link. Otherwise they
// could replace it.
Result<> CheckOwner(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return Failure(Problem(path));
  if (!S_ISDIR(status.st_mode)) return Failure(path + " is no directory (a link?)" + kElsewhere);
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return Failure(path + " belongs to user " + std::to_string(status.st_uid) + ", not to us" + kElsewhere);
  }
  return {};
}

// Returns the name of a file system on which a log or a journal is not safe (statfs(2)); no text for others.
std::string FileSystemName(const std::string& path) {
  struct statfs status {};
  if (statfs(path.c_str(), &status) != 0) return "";
  switch (static_cast<unsigned long>(status.f_type) & 0xFFFFFFFF) {
    case TMPFS_MAGIC:
      return "tmpfs";
    case RAMFS_MAGIC:
      return "ramfs";
    case NFS_SUPER_MAGIC:
      return "nfs";
    case SMB_SUPER_MAGIC:
    case 0xFF534D42:  // cifs
    case 0xFE534D42:  // smb2
      return "cifs";
    case MSDOS_SUPER_MAGIC:
      return "vfat";
    default:
      return "";
  }
}

constexpr int kMaxLinks = 40;  // as in the kernel: path_resolution(7)

// Follows a path name by name.
class Walk {
 public:
  explicit Walk(const std::filesystem::path& path) { Insert(std::filesystem::absolute(path)); }

  Result<> Run() {
    while (!names_.empty()) {
      const std::filesystem::path name = names_.front();
      names_.pop_front();
      if (name == "..") {
        walked_ = walked_.parent_path();
      } else if (name != ".") {
        if (Result<> done = Enter(walked_ / name); !done) return done;
      }
    }
    return {};
  }

 private:
  // Names that come next.
  void Insert(const std::filesystem::path& path) {
    if (path.is_absolute()) walked_ = "/";
    const std::filesystem::path names = path.relative_path();
    names_.insert(names_.begin(), names.begin(), names.end());
  }

  Result<> Enter(const std::filesystem::path& place) {
    struct stat status {};
    if (lstat(place.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) {
      walked_ = place;
      return {};
    }
    if (status.st_uid != geteuid() && status.st_uid != 0) {
      return Failure(place.string() + " is a symbolic link of user " + std::to_string(status.st_uid) +
                     ", who could let it lead anywhere: name the place itself, or as root: chown -h " +
                     std::to_string(geteuid()) + " '" + place.string() + "'");
    }
    if (++links_ > kMaxLinks) return Failure(place.string() + ": " + std::strerror(ELOOP));
    std::error_code error;
    const std::filesystem::path target = std::filesystem::read_symlink(place, error);
    if (error) return Failure(place.string() + ": " + error.message());
    Insert(target);
    return {};
  }

  std::filesystem::path walked_;
  std::list<std::filesystem::path> names_;
  int links_ = 0;
};

}  // namespace

Result<> PrepareRunDirectory(const std::string& path) {
  std::filesystem::path walked;
  for (const auto& part : std::filesystem::path(path).lexically_normal()) {
    const bool exposed = !walked.empty() && OthersMayWrite(walked);
    walked /= part;
    if (mkdir(walked.c_str(), 0700) != 0 && errno != EEXIST) return Failure(Problem(walked));
    if (!exposed) continue;
    if (Result<> done = CheckOwner(walked); !done) return done;
  }
  const Descriptor directory(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!directory.valid()) return Failure(Problem(path));
  struct stat status {};
  if (fstat(directory.get(), &status) != 0) return Failure(Problem(path));
  if (status.st_uid != geteuid()) {
    return Failure(path + " belongs to user " + std::to_string(status.st_uid) + ", not to us" + kElsewhere);
  }
  if (fchmod(directory.get(), 0700) != 0) return Failure(Problem(path));
  return {};
}

int MakeFolders(const std::string& path, mode_t mode, std::string& failed) {
  std::filesystem::path walked;
  struct stat above {};
  for (const auto& part : std::filesystem::path(path)) {
    walked /= part;
    failed = walked.string();
    const bool made = mkdir(walked.c_str(), mode) == 0;
    const int error = errno;  // also of an existing folder on a read-only disk
    struct stat status {};
    const bool found = stat(walked.c_str(), &status) == 0;
    if (!found || !S_ISDIR(status.st_mode)) return found || error == EEXIST ? ENOTDIR : error;
    const bool is_mount_point = status.st_dev != above.st_dev;  // has no entry above it
    above = status;
    if (!made && (status.st_uid != geteuid() || is_mount_point || !walked.has_filename())) continue;
    // An existing folder may be below one that this user cannot read.
    if (const int unsynced = SyncFolderOf(walked.string()); made && unsynced != 0) return unsynced;
  }
  return 0;
}

Result<> MakeFolders(const std::string& path, mode_t mode) {
  std::string failed;
  const int error = MakeFolders(path, mode, failed);
  return error == 0 ? Result<>() : Failure(failed + ": " + std::strerror(error));
}

Result<> LockFile::Acquire(const std::string& path) {
  Descriptor file(open(path.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file.valid()) return Failure(path + ": " + std::strerror(errno));
  if (flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return Failure(path + ": " + std::strerror(errno));
    std::array<char, 16> holder{};
    const ssize_t size = pread(file.get(), holder.data(), holder.size() - 1, 0);
    return Failure(path + " is held by process " + (size > 0 ? holder.data() : "(unknown)"));
  }
  const std::string id = std::to_string(getpid());
  if (ftruncate(file.get(), 0) != 0 || pwrite(file.get(), id.data(), id.size(), 0) < 0) {
    return Failure(path + ": " + std::strerror(errno));
  }
  file_ = std::move(file);
  return {};
}

pid_t LockFile::Holder(const std::string& path) {
  const Descriptor file(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (!file.valid() || flock(file.get(), LOCK_SH | LOCK_NB) == 0) return 0;
  std::array<char, 16> text{};
  const ssize_t size = pread(file.get(), text.data(), text.size() - 1, 0);
  pid_t holder = 0;
  if (size > 0) std::from_chars(text.data(), text.data() + size, holder);
  return holder;
}

HostFolder LookAtFolder(const std::string& path) {
  HostFolder folder;
  folder.path = path;
  std::error_code error;
  std::filesystem::path place = std::filesystem::absolute(path, error).lexically_normal();
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  folder.existing = place.string();
  folder.is_folder = std::filesystem::is_directory(place, error);
  folder.writable = faccessat(AT_FDCWD, place.c_str(), W_OK | X_OK, AT_EACCESS) == 0;
  folder.file_system = FileSystemName(place.string());
  struct statvfs status {};
  if (statvfs(place.c_str(), &status) == 0) {
    folder.free_bytes = static_cast<std::int64_t>(status.f_bavail * status.f_frsize);
  }
  return folder;
}

Result<> CheckLinks(const std::string& path) { return Walk(path).Run(); }

}  // namespace axlecast
