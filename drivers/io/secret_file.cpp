#include "drivers/io/secret_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "drivers/io/descriptor.h"

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

// Who may see the file. `closed_to`: the mode bits that must not be set.
std::string CheckFile(int fd, const std::string& path, mode_t closed_to) {
  struct stat status {};
  if (fstat(fd, &status) != 0) return path + ": " + std::strerror(errno);
  if (!S_ISREG(status.st_mode)) return path + " is no regular file: name the file that holds the secret";
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return path + " belongs to user " + std::to_string(status.st_uid) + ", who could read or change it: chown " +
           std::to_string(geteuid()) + " " + Quoted(path);
  }
  if ((status.st_mode & closed_to) != 0) return path + " is open to other users: chmod 600 " + Quoted(path);
  return "";
}

// At most one byte more than allowed.
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

std::string OpenProblem(const std::string& path, int error) {
  if (error == EACCES) {
    return path + ": permission denied; as root: chown " + std::to_string(geteuid()) + " " + Quoted(path) +
           " && chmod 600 " + Quoted(path);
  }
  if (error == ENOENT) return path + " does not exist: write the secret there, with mode 0600";
  return path + ": " + std::strerror(error);
}

std::string ReadFile(const std::string& path, mode_t closed_to, Secret& into) {
  // O_NONBLOCK: a FIFO under this name must not keep the driver waiting.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!file.valid()) return OpenProblem(path, errno);
  if (std::string problem = CheckFile(file.get(), path, closed_to); !problem.empty()) return problem;
  WipedBuffer buffer;
  if (!ReadAll(file.get(), buffer)) return path + ": " + std::strerror(errno);
  if (buffer.size > kLongestSecret) {
    return path + " holds more than " + std::to_string(kLongestSecret) + " bytes: is it the right file?";
  }
  std::string_view text = buffer.text();
  if (text.find('\0') != std::string_view::npos) return path + " holds a NUL byte: it must be text";
  if (text.ends_with('\n')) text.remove_suffix(1);
  if (text.empty()) return path + " is empty: write the secret there";
  // Room on the heap, which a move hands over: a short string would leave a copy behind in its place.
  std::string content;
  content.reserve(kLongestSecret);
  content = text;
  into = Secret(std::move(content));
  return "";
}

std::string ReadCredential(const std::string& name, Secret& into) {
  if (name.find('/') != std::string::npos || name == "." || name == "..") {
    return "credential '" + name + "' is no name of one: it is a plain file name";
  }
  const char* const directory = std::getenv("CREDENTIALS_DIRECTORY");
  if (directory == nullptr || *directory == '\0') {
    return "credential '" + name + "': systemd has passed none to this process; put LoadCredential=" + name +
           ":PATH into the unit's [Service] section, or name a file";
  }
  // Where systemd opens a credential to the unit's user by an ACL, it shows as readable by the group.
  return ReadFile(std::string(directory) + '/' + name, S_IRWXO | S_IWGRP | S_IXGRP, into);
}

}  // namespace

std::string SecretFiles::Read(const SecretPlace& place, Secret& into) {
  if (!place.file.empty()) return ReadFile(place.file, S_IRWXG | S_IRWXO, into);
  if (!place.credential.empty()) return ReadCredential(place.credential, into);
  return "no place of a secret is configured: name a file or a credential";
}

}  // namespace axlecast
