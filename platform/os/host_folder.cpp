#include "platform/os/host_folder.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/statvfs.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

namespace axlecast {
namespace {

// statfs(2). Those on which a log or a journal is not what it is elsewhere.
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

}  // namespace

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

}  // namespace axlecast
