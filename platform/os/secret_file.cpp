#include "platform/os/secret_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "platform/os/descriptor.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestSecret = 4096;

// The content of a file on its way into a Secret.
struct WipedBuffer {
  WipedBuffer() = default;
  ~WipedBuffer() { explicit_bzero(bytes.data(), bytes.size()); }
  WipedBuffer(const WipedBuffer&) = delete;
  WipedBuffer& operator=(const WipedBuffer&) = delete;

  [[nodiscard]] std::string_view text() const { return {bytes.data(), size}; }

  std::array<char, kLongestSecret + 1> bytes{};
  std::size_t size = 0;
};

std::string Quoted(const std::string& path) { return "'" + path + "'"; }

// The access that the group of a file may have.
enum class Group : std::uint8_t {
  kNothing,
  kRead,        // because the configuration allows it
  kCredential,  // because systemd's ACL for the user of the unit appears as that of the group
};

mode_t ClosedTo(Group group) { return group == Group::kNothing ? S_IRWXG | S_IRWXO : S_IWGRP | S_IXGRP | S_IRWXO; }

// The command that makes the file readable for this process, or unreadable for others.
std::string Chmod(const std::string& path, Group group) {
  return (group == Group::kRead ? "chmod 640 " : "chmod 600 ") + Quoted(path);
}

// Checks who may read the file.
Result<> CheckFile(int fd, const std::string& path, Group group) {
  struct stat status {};
  if (fstat(fd, &status) != 0) return Failure(path + ": " + std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return Failure(path + " is no regular file: name the file that holds the secret");
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return Failure(path + " belongs to user " + std::to_string(status.st_uid) +
                   ", who could read or change it: chown " + std::to_string(geteuid()) + " " + Quoted(path));
  }
  if ((status.st_mode & ClosedTo(group)) != 0)
    return Failure(path + " is open to other users: " + Chmod(path, group));
  return {};
}

// Reads at most one byte more than allowed.
bool ReadAll(int fd, WipedBuffer& buffer) {
  while (buffer.size < buffer.bytes.size()) {
    const ssize_t count = read(fd, buffer.bytes.data() + buffer.size, buffer.bytes.size() - buffer.size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    if (count == 0) break;
    buffer.size += static_cast<std::size_t>(count);
  }
  return true;
}

std::string OpenProblem(const std::string& path, Group group, int error) {
  if (error == EACCES && group == Group::kRead) {
    return path + ": permission denied to user " + std::to_string(geteuid()) +
           ": become a member of the file's group (ls -l " + Quoted(path) +
           " names it; as root: usermod -aG GROUP USER, then log in again)";
  }
  if (error == EACCES) {
    return path + ": permission denied; as root: chown " + std::to_string(geteuid()) + " " + Quoted(path) +
           " && chmod 600 " + Quoted(path);
  }
  if (error == ENOENT) return path + " does not exist: write the secret there, with mode 0600";
  return path + ": " + std::strerror(error);
}

Result<Secret> ReadFile(const std::string& path, Group group) {
  // O_NONBLOCK: a FIFO of this name must not block the driver.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!file.valid()) return Failure(OpenProblem(path, group, errno));
  if (Result<> done = CheckFile(file.get(), path, group); !done) return Failure(std::move(done).error());
  WipedBuffer buffer;
  if (!ReadAll(file.get(), buffer)) return Failure(path + ": " + std::strerror(errno));
  if (buffer.size > kLongestSecret) {
    return Failure(path + " holds more than " + std::to_string(kLongestSecret) + " bytes: is it the right file?");
  }
  std::string_view text = buffer.text();
  if (text.find('\0') != std::string_view::npos) return Failure(path + " holds a NUL byte: it must be text");
  if (text.ends_with('\n')) text.remove_suffix(1);
  if (text.empty()) return Failure(path + " is empty: write the secret there");
  // On the heap, which a move passes on. Moving a short string would leave a copy behind.
  std::string content;
  content.reserve(kLongestSecret);
  content = text;
  return Secret(std::move(content));
}

Result<Secret> ReadCredential(const std::string& name) {
  if (name.find('/') != std::string::npos || name == "." || name == "..") {
    return Failure("credential '" + name + "' is no name of one: it is a plain file name");
  }
  const char* const directory = std::getenv("CREDENTIALS_DIRECTORY");
  if (directory == nullptr || *directory == '\0') {
    return Failure("credential '" + name + "': systemd has passed none to this process; put LoadCredential=" +
                   name + ":PATH into the unit's [Service] section, or name a file");
  }
  return ReadFile(std::string(directory) + '/' + name, Group::kCredential);
}

}  // namespace

Result<Secret> SecretFiles::Read(const SecretPlace& place) {
  if (!place.file.empty()) return ReadFile(place.file, place.group_may_read ? Group::kRead : Group::kNothing);
  if (!place.credential.empty()) return ReadCredential(place.credential);
  return Failure("no place of a secret is configured: name a file or a credential");
}

}  // namespace axlecast
