#include "tools/axlecast/run/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/os/process.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestLine = 4096;  // longer ones are cut into several
constexpr int kReadsAtOnce = 16;            // a child that writes without end does not keep us

// Between fork and exec only async-signal-safe calls: the parent has threads.
[[noreturn]] void Become(char* const* argv, int output, int errors, pid_t parent) {
  setsid();
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the line above
  const int null = open("/dev/null", O_RDWR);
  dup2(null, STDIN_FILENO);
  dup2(output >= 0 ? output : null, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  close_range(3, ~0U, 0);
  static_cast<void>(signal(SIGPIPE, SIG_DFL));
  execv(argv[0], argv);
  const char* why = strerrordesc_np(errno);
  for (const char* part :
       {"cannot run ", static_cast<const char*>(argv[0]), ": ", why == nullptr ? "?" : why, "\n"}) {
    if (write(STDERR_FILENO, part, strlen(part)) < 0) break;
  }
  _exit(127);
}

}  // namespace

ChildProcess::~ChildProcess() {
  if (!running()) return;
  Signal(SIGKILL);
  waitpid(pid_, nullptr, 0);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), errors_(std::move(other.errors_)), partial_(std::move(other.partial_)) {}

std::string ChildProcess::Start(const std::vector<std::string>& argv, int output) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return std::string("cannot make a pipe: ") + std::strerror(errno);
  Descriptor read_end(ends[0]);
  const Descriptor write_end(ends[1]);
  if (fcntl(read_end.get(), F_SETFL, O_NONBLOCK) != 0) return std::string("fcntl: ") + std::strerror(errno);

  std::vector<char*> arguments;
  arguments.reserve(argv.size() + 1);
  for (const std::string& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = ForkWithoutHandlers();
  if (pid < 0) return std::string("cannot fork: ") + std::strerror(errno);
  if (pid == 0) Become(arguments.data(), output, write_end.get(), parent);
  pid_ = pid;
  errors_ = std::move(read_end);
  partial_.clear();
  return "";
}

std::vector<std::string> ChildProcess::ReadLines() {
  std::vector<std::string> lines;
  std::array<char, 4096> buffer{};
  bool ended = false;
  for (int reads = 0; errors_.valid() && reads < kReadsAtOnce; ++reads) {
    const ssize_t count = read(errors_.get(), buffer.data(), buffer.size());
    if (count < 0) {
      if (errno == EINTR) continue;
      break;
    }
    if (count == 0) {
      ended = true;
      errors_.Reset();
      break;
    }
    partial_.append(buffer.data(), static_cast<std::size_t>(count));
    for (std::size_t end = 0; (end = partial_.find('\n')) != std::string::npos || partial_.size() > kLongestLine;) {
      const std::size_t length = std::min(end, kLongestLine);
      lines.push_back(partial_.substr(0, length));
      partial_.erase(0, length + (length == end ? 1 : 0));
    }
  }
  if (ended && !partial_.empty()) lines.push_back(std::exchange(partial_, {}));
  return lines;
}

std::optional<ChildProcess::End> ChildProcess::Reap() {
  if (!running()) return std::nullopt;
  int status = 0;
  const pid_t reaped = waitpid(pid_, &status, WNOHANG);
  if (reaped == 0 || (reaped < 0 && errno == EINTR)) return std::nullopt;
  pid_ = -1;
  if (reaped < 0) return End{false, "lost"};
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return End{false, "killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")"};
  }
  return End{WEXITSTATUS(status) == 0, "exit code " + std::to_string(WEXITSTATUS(status))};
}

void ChildProcess::Signal(int signal) const {
  if (!running()) return;
  if (kill(-pid_, signal) != 0) kill(pid_, signal);  // before setsid there is no group yet
}

}  // namespace axlecast
