#include "tools/doctor/host/host_files.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "core/base/result.h"
#include "platform/os/descriptor.h"
#include "platform/os/new_file.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxText = 64 << 10;
constexpr std::size_t kMaxOutput = 4 << 20;  // of a program

HostFile::Kind KindOf(mode_t mode) {
  if (S_ISREG(mode)) return HostFile::Kind::kRegular;
  if (S_ISDIR(mode)) return HostFile::Kind::kFolder;
  return S_ISCHR(mode) ? HostFile::Kind::kCharacter : HostFile::Kind::kOther;
}

template <typename Number>
std::optional<Number> ToNumber(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

bool Holds(const std::string& place, pid_t id, dev_t device) {
  std::error_code error;
  for (const auto& entry :
       std::filesystem::directory_iterator(place + "/proc/" + std::to_string(id) + "/fd", error)) {
    struct stat status {};
    if (stat(entry.path().c_str(), &status) == 0 && S_ISCHR(status.st_mode) && status.st_rdev == device)
      return true;
  }
  return false;
}

// proc(5): "3: FLOCK  ADVISORY  WRITE 1234 00:06:1234 0 EOF"; a process that waits for a lock has "->" after the number.
std::vector<pid_t> Lockers(const std::string& locks, const struct stat& file) {
  std::array<char, 64> file_id{};
  std::snprintf(file_id.data(), file_id.size(), "%02x:%02x:%lu", major(file.st_dev), minor(file.st_dev),
                file.st_ino);
  std::vector<pid_t> ids;
  std::istringstream lines(locks);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string number, kind, how, access, id, inode;
    words >> number >> kind >> how >> access >> id >> inode;
    if (inode != file_id.data() || kind == "->") continue;
    if (const auto process = ToNumber<pid_t>(id); process && *process > 0) ids.push_back(*process);
  }
  return ids;
}

std::string Reason() { return std::strerror(errno); }

// Also searches the folders of administration programs, which are not in an ordinary user's PATH.
std::string FindProgram(const std::string& name) {
  const char* const given = std::getenv("PATH");
  std::istringstream folders(std::string(given == nullptr ? "" : given) + ":/usr/sbin:/sbin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::string path = folder + '/' + name;
    if (!folder.empty() && access(path.c_str(), X_OK) == 0) return path;
  }
  return "";
}

std::string ReadToEnd(int fd) {
  std::string text;
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t count = read(fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    if (text.size() < kMaxOutput) text.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

// Starts a program with these descriptors as standard output and error. Returns 0, or the errno of a failure.
int Spawn(const std::string& program, const std::vector<std::string>& words, int output, int errors, pid_t& id) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, errors, STDERR_FILENO);
  const int error = posix_spawn(&id, program.c_str(), &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  return error;
}

// Opens an unnamed file for the standard error of a child. Unlike a pipe, it cannot fill up while nobody reads it.
Descriptor ScratchFile() { return Descriptor(open("/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)); }

}  // namespace

HostFile HostFiles::Look(const std::string& path) const {
  HostFile file;
  file.path = path;
  const std::string place = Place(path);
  struct stat status {};
  if (stat(place.c_str(), &status) != 0) {
    file.error = errno;
    return file;
  }
  file.kind = KindOf(status.st_mode);
  file.mode = status.st_mode & 07777;
  file.uid = status.st_uid;
  file.gid = status.st_gid;
  const passwd* const owner = getpwuid(status.st_uid);
  file.owner = owner == nullptr ? std::to_string(status.st_uid) : owner->pw_name;
  const ::group* const group = getgrgid(status.st_gid);
  file.group = group == nullptr ? std::to_string(status.st_gid) : group->gr_name;
  if (file.kind == HostFile::Kind::kCharacter) {
    file.major = major(status.st_rdev);
    file.minor = minor(status.st_rdev);
  }
  file.readable = faccessat(AT_FDCWD, place.c_str(), R_OK, AT_EACCESS) == 0;
  file.writable = faccessat(AT_FDCWD, place.c_str(), W_OK, AT_EACCESS) == 0;
  return file;
}

std::optional<std::string> HostFiles::Text(const std::string& path) const {
  const Descriptor file(open(Place(path).c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK));
  if (!file.valid()) return std::nullopt;
  std::string text(kMaxText, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t count = read(file.get(), text.data() + size, text.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return std::nullopt;
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  text.resize(size);
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

std::optional<std::int64_t> HostFiles::Number(const std::string& path) const {
  const std::optional<std::string> text = Text(path);
  return text ? ToNumber<std::int64_t>(*text) : std::nullopt;
}

std::vector<std::string> HostFiles::Names(const std::string& folder) const {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(Place(folder), error)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

HostProcess HostFiles::Process(pid_t id) const {
  const std::string folder = "/proc/" + std::to_string(id);
  HostProcess process{.id = id, .name = Text(folder + "/comm").value_or(""), .words = {}};
  std::istringstream words(Text(folder + "/cmdline").value_or(""));
  for (std::string word; std::getline(words, word, '\0');) process.words.push_back(word);
  return process;
}

std::vector<pid_t> HostFiles::ProcessIds() const {
  std::vector<pid_t> ids;
  for (const std::string& name : Names("/proc")) {
    if (const auto id = ToNumber<pid_t>(name); id && *id != getpid()) ids.push_back(*id);
  }
  return ids;
}

std::vector<HostProcess> HostFiles::Processes() const {
  std::vector<HostProcess> processes;
  for (const pid_t id : ProcessIds()) processes.push_back(Process(id));
  return processes;
}

std::vector<HostProcess> HostFiles::Holders(const std::string& device) const {
  struct stat status {};
  if (stat(Place(device).c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return {};
  const std::vector<pid_t> lockers = Lockers(Text("/proc/locks").value_or(""), status);
  std::vector<HostProcess> holders;
  for (const pid_t id : ProcessIds()) {
    const bool locks = std::find(lockers.begin(), lockers.end(), id) != lockers.end();
    if (locks || Holds(root_, id, status.st_rdev)) holders.push_back(Process(id));
  }
  return holders;
}

Result<std::string> RunProgram(const std::vector<std::string>& words) {
  const std::string program = FindProgram(words.front());
  if (program.empty()) return Failure(words.front() + " is not installed");
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return Failure(Reason());
  const Descriptor reader(ends[0]);
  Descriptor writer(ends[1]);
  const Descriptor errors = ScratchFile();
  pid_t id = -1;
  if (const int error = Spawn(program, words, writer.get(), errors.valid() ? errors.get() : writer.get(), id)) {
    return Failure(program + ": " + std::strerror(error));
  }
  writer.Reset();
  std::string output = ReadToEnd(reader.get());
  int status = 0;
  while (waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return output;
  if (errors.valid() && lseek(errors.get(), 0, SEEK_SET) == 0) output += ReadToEnd(errors.get());
  while (output.ends_with('\n')) output.pop_back();
  return Failure(words.front() + (output.empty() ? " failed" : ": " + output));
}

Result<> WriteValue(const std::string& path, const std::string& value) {
  const Descriptor file(open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY));
  const std::string line = value + '\n';
  if (file.valid() && write(file.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size())) return {};
  return Failure(path + ": " + Reason());
}

Result<> AppendLine(const std::string& path, const std::string& line) {
  std::string text;
  if (std::ifstream file(path); file) text.assign(std::istreambuf_iterator<char>(file), {});
  std::istringstream lines(text);
  for (std::string found; std::getline(lines, found);) {
    if (found == line) return {};
  }
  if (!text.empty() && !text.ends_with('\n')) text += '\n';
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  if (error) return Failure(path + ": " + error.message());
  std::string problem = ErrorText(WriteNewFile(path, text + line + '\n', {.mode = 0644}, true));
  if (!problem.empty()) return Failure(std::move(problem));
  return {};
}

}  // namespace axlecast
