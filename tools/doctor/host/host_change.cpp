#include "tools/doctor/host/host_change.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "platform/os/descriptor.h"
#include "platform/os/new_file.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxOutput = 4 << 20;

std::string Reason() { return std::strerror(errno); }

// Administrators' programs stand outside an ordinary user's PATH.
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

// Its standard output and error go into these descriptors. Gives the errno of a failure.
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

// A file without a name, for what a child says on standard error: nobody has to read it meanwhile.
Descriptor ScratchFile() { return Descriptor(open("/tmp", O_TMPFILE | O_RDWR | O_CLOEXEC, 0600)); }

}  // namespace

ProgramResult RunProgram(const std::vector<std::string>& words) {
  ProgramResult result;
  const std::string program = FindProgram(words.front());
  if (program.empty()) {
    result.problem = words.front() + " is not installed";
    return result;
  }
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    result.problem = Reason();
    return result;
  }
  const Descriptor reader(ends[0]);
  Descriptor writer(ends[1]);
  const Descriptor errors = ScratchFile();
  pid_t id = -1;
  if (const int error = Spawn(program, words, writer.get(), errors.valid() ? errors.get() : writer.get(), id)) {
    result.problem = program + ": " + std::strerror(error);
    return result;
  }
  writer.Reset();
  result.output = ReadToEnd(reader.get());
  int status = 0;
  while (waitpid(id, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return result;
  std::string said = result.output;
  if (errors.valid() && lseek(errors.get(), 0, SEEK_SET) == 0) said += ReadToEnd(errors.get());
  while (said.ends_with('\n')) said.pop_back();
  result.problem = words.front() + (said.empty() ? " failed" : ": " + said);
  return result;
}

std::string WriteValue(const std::string& path, const std::string& value) {
  const Descriptor file(open(path.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC | O_NOCTTY));
  if (!file.valid()) return path + ": " + Reason();
  const std::string line = value + '\n';
  if (write(file.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size())) return "";
  return path + ": " + Reason();
}

std::string AppendLine(const std::string& path, const std::string& line) {
  std::string text;
  if (std::ifstream file(path); file) text.assign(std::istreambuf_iterator<char>(file), {});
  std::istringstream lines(text);
  for (std::string found; std::getline(lines, found);) {
    if (found == line) return "";
  }
  if (!text.empty() && !text.ends_with('\n')) text += '\n';
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  if (error) return path + ": " + error.message();
  return WriteNewFile(path, text + line + '\n', {.mode = 0644}, true);
}

}  // namespace axlecast
