#include "platform/os/foreign_link.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <list>
#include <system_error>

namespace axlecast {
namespace {

constexpr int kMaxLinks = 40;  // as the kernel has it: path_resolution(7)

// Follows a path name by name.
class Walk {
 public:
  explicit Walk(const std::filesystem::path& path) { Insert(std::filesystem::absolute(path)); }

  std::string Run() {
    while (!names_.empty()) {
      const std::filesystem::path name = names_.front();
      names_.pop_front();
      if (name == "..") {
        walked_ = walked_.parent_path();
      } else if (name != ".") {
        if (std::string problem = Enter(walked_ / name); !problem.empty()) return problem;
      }
    }
    return "";
  }

 private:
  // Names that come next.
  void Insert(const std::filesystem::path& path) {
    if (path.is_absolute()) walked_ = "/";
    const std::filesystem::path names = path.relative_path();
    names_.insert(names_.begin(), names.begin(), names.end());
  }

  std::string Enter(const std::filesystem::path& place) {
    struct stat status {};
    if (lstat(place.c_str(), &status) != 0 || !S_ISLNK(status.st_mode)) {
      walked_ = place;
      return "";
    }
    if (status.st_uid != geteuid() && status.st_uid != 0) {
      return place.string() + " is a symbolic link of user " + std::to_string(status.st_uid) +
             ", who could let it lead anywhere: name the place itself, or as root: chown -h " +
             std::to_string(geteuid()) + " '" + place.string() + "'";
    }
    if (++links_ > kMaxLinks) return place.string() + ": " + std::strerror(ELOOP);
    std::error_code error;
    const std::filesystem::path target = std::filesystem::read_symlink(place, error);
    if (error) return place.string() + ": " + error.message();
    Insert(target);
    return "";
  }

  std::filesystem::path walked_;
  std::list<std::filesystem::path> names_;
  int links_ = 0;
};

}  // namespace

std::string ForeignLinkProblem(const std::string& path) { return Walk(path).Run(); }

}  // namespace axlecast
