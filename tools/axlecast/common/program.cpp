#include "tools/axlecast/common/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace axlecast {

std::string ProgramFolder() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return error ? "." : program.parent_path().string();
}

std::string CompanionProgram(std::string_view name) { return ProgramFolder() + "/axlecast-" + std::string(name); }

std::string DriverProgram(std::string_view family_name) {
  std::string name(family_name);
  std::replace(name.begin(), name.end(), '_', '-');
  return CompanionProgram(name);
}

std::vector<char*> ArgumentPointers(const std::vector<std::string>& argv) {
  std::vector<char*> arguments;
  arguments.reserve(argv.size() + 1);
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  return arguments;
}

std::string ExitText(int status) {
  if (!WIFSIGNALED(status)) return "exit code " + std::to_string(WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  return "killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

Error Become(const std::vector<std::string>& argv) {
  static_cast<void>(signal(SIGPIPE, SIG_DFL));  // an ignored signal would stay ignored
  execvp(argv[0].c_str(), ArgumentPointers(argv).data());
  return Error{"cannot run " + argv[0] + ": " + std::strerror(errno)};
}

std::string HostName() {
  std::array<char, 256> host{};
  return gethostname(host.data(), host.size() - 1) == 0 ? host.data() : "";
}

std::string ThisHost(const std::string& given) {
  const std::string name = HostName();
  return given.empty() ? name.substr(0, name.find('.')) : given;
}

ProcessLog::ProcessLog(std::string path, std::int64_t limit) : path_(std::move(path)), limit_(limit) { Open(); }

void ProcessLog::Open() {
  file_.Reset();
  file_ = Descriptor(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0640));
  struct stat status {};
  size_ = file_.valid() && fstat(file_.get(), &status) == 0 ? status.st_size : 0;
}

void ProcessLog::Write(std::string_view line) {
  const std::string text = std::string(line) + '\n';
  if (size_ + static_cast<std::int64_t>(text.size()) > limit_) {
    if (std::rename(path_.c_str(), (path_ + ".1").c_str()) == 0) Open();
  }
  if (!file_.valid()) return;
  const ssize_t written = write(file_.get(), text.data(), text.size());
  if (written > 0) size_ += written;
}

bool WorthShowing(std::string_view line) {
  constexpr int kFirstWords = 4;  // time (one or two words), name and level, in any order
  std::size_t at = 0;
  for (int word = 0; word < kFirstWords; ++word) {
    at = line.find_first_not_of(" []", at);
    if (at == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" []", at), line.size());
    const std::string_view level = line.substr(at, end - at);
    if (level == "info" || level == "debug" || level == "trace") return false;
    at = end;
  }
  return !line.empty();
}

}  // namespace axlecast
