#include "tools/axlecast/run/process_supervisor.h"

#include <fcntl.h>
#include <poll.h>
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

constexpr std::size_t kLongestLine = 4096;  // longer lines are split
constexpr int kReadsAtOnce = 16;            // a child that writes continuously must not block this process

// Between fork and exec, only async-signal-safe calls are allowed: the parent has threads.
[[noreturn]] void Execute(char* const* argv, int output, int errors, pid_t parent) {
  setsid();
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it ended before the line above
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

constexpr MonoNs kFirstBackOff = 500 * kMillisecond;
constexpr MonoNs kLongestBackOff = 10 * kSecond;
constexpr MonoNs kRanWell = 30 * kSecond;
constexpr MonoNs kEndTimeout = 3 * kSecond;
constexpr MonoNs kRecorderEndTimeout = 60 * kSecond;  // it writes its queue to a disk that may be slow
constexpr std::size_t kDeathsKept = 1000;

std::string Seconds(MonoNs time) { return std::to_string(time / kSecond) + (time % kSecond == 0 ? " s" : ".5 s"); }

}  // namespace

ChildProcess::~ChildProcess() {
  if (!running()) return;
  Signal(SIGKILL);
  waitpid(pid_, nullptr, 0);
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), errors_(std::move(other.errors_)), partial_(std::move(other.partial_)) {}

Result<> ChildProcess::Start(const std::vector<std::string>& argv, int output) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    return Failure(std::string("cannot create a pipe: ") + std::strerror(errno));
  Descriptor read_end(ends[0]);
  const Descriptor write_end(ends[1]);
  if (fcntl(read_end.get(), F_SETFL, O_NONBLOCK) != 0)
    return Failure(std::string("fcntl: ") + std::strerror(errno));

  const std::vector<char*> arguments = ArgumentPointers(argv);
  const pid_t parent = getpid();
  const pid_t pid = ForkWithoutHandlers();
  if (pid < 0) return Failure(std::string("cannot fork: ") + std::strerror(errno));
  if (pid == 0) Execute(arguments.data(), output, write_end.get(), parent);
  pid_ = pid;
  errors_ = std::move(read_end);
  partial_.clear();
  return {};
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
  return End{WIFEXITED(status) && WEXITSTATUS(status) == 0, ExitText(status)};
}

void ChildProcess::Signal(int signal) const {
  if (!running()) return;
  if (kill(-pid_, signal) != 0) kill(pid_, signal);  // before setsid there is no group yet
}

ProcessSupervisor::ProcessSupervisor(std::string log_directory, const Clock& clock,
                                     std::function<void(const std::string& line)> show)
    : log_directory_(std::move(log_directory)), clock_(clock), show_(std::move(show)) {}

ProcessSupervisor::~ProcessSupervisor() = default;

void ProcessSupervisor::Start(Role role, const std::string& name, std::vector<std::string> argv) {
  std::string file = name;
  std::replace(file.begin(), file.end(), ' ', '-');
  members_.push_back({role, name, std::move(argv), ProcessLog(log_directory_ + '/' + file + ".log"), {}});
  Launch(members_.back());
}

void ProcessSupervisor::Launch(Member& member) {
  member.restart_at = kNever;
  member.started = clock_.Now();
  if (const Result<> started = member.child.Start(member.argv, member.log.FileDescriptor()); !started) {
    return OnEnd(member, started.error().text);
  }
  member.log.Write("== started, process " + std::to_string(member.child.pid()));
}

void ProcessSupervisor::OnEnd(Member& member, const std::string& how) {
  const MonoNs now = clock_.Now();
  member.back_off = now - member.started >= kRanWell || member.back_off == 0
                        ? kFirstBackOff
                        : std::min(2 * member.back_off, kLongestBackOff);
  member.restart_at = now + member.back_off;
  if (deaths_.size() < kDeathsKept) {
    const bool by_itself = how.starts_with("exit code") && !member.last_shown.empty();
    deaths_.push_back(member.name + ": " + how + (by_itself ? ": " + member.last_shown : ""));
  }
  member.last_shown.clear();
  member.log.Write("== ended: " + how);
  show_(member.name + " ended: " + how + "; starting it again in " + Seconds(member.back_off));
}

void ProcessSupervisor::ReadLog(Member& member) {
  for (const std::string& line : member.child.ReadLines()) {
    member.log.Write(line);
    if (!WorthShowing(line)) continue;
    member.last_shown = line;
    show_(member.name + ": " + line);
  }
}

void ProcessSupervisor::Poll() {
  for (Member& member : members_) {
    ReadLog(member);
    if (const auto end = member.child.Reap()) {
      ReadLog(member);
      OnEnd(member, end->text);
    }
    if (!member.child.running() && clock_.Now() >= member.restart_at) Launch(member);
  }
}

std::vector<int> ProcessSupervisor::FileDescriptors() const {
  std::vector<int> descriptors;
  for (const Member& member : members_) {
    if (member.child.FileDescriptor() >= 0) descriptors.push_back(member.child.FileDescriptor());
  }
  return descriptors;
}

// The exit code reports a failure, for example that a broker never accepted a message.
void ProcessSupervisor::OnStopped(Member& member, const ChildProcess::End& end) {
  member.log.Write("== ended: " + end.text);
  if (end.clean || !end.text.starts_with("exit code") || deaths_.size() >= kDeathsKept) return;
  deaths_.push_back(member.name + ": " + end.text + " at its end: the reason is in " + member.log.path());
}

bool ProcessSupervisor::AnyRunning(Role role) const {
  return std::any_of(members_.begin(), members_.end(),
                     [role](const Member& member) { return member.role == role && member.child.running(); });
}

void ProcessSupervisor::Stop(const std::function<bool()>& hurry) {
  for (const Role role : {Role::kWeb, Role::kDriver, Role::kBridge, Role::kSimulator, Role::kRecorder}) {
    StopRole(role, hurry);
  }
}

void ProcessSupervisor::StopRole(Role role, const std::function<bool()>& hurry) {
  for (Member& member : members_) {
    if (member.role != role) continue;
    member.restart_at = kNever;
    member.child.Signal(SIGTERM);
  }
  const MonoNs deadline = clock_.Now() + (role == Role::kRecorder ? kRecorderEndTimeout : kEndTimeout);
  bool killed = false;
  while (AnyRunning(role)) {
    const bool kill_now = clock_.Now() >= deadline || hurry();
    for (Member& member : members_) {
      if (kill_now && !killed && member.role == role && member.child.running()) {
        show_(member.name + " does not end: killed");
        member.child.Signal(SIGKILL);
      }
      // The output of all processes is read, so that no process blocks.
      ReadLog(member);
      if (member.role != role) continue;
      if (const auto end = member.child.Reap()) {
        ReadLog(member);
        OnStopped(member, *end);
      }
    }
    killed = killed || kill_now;
    if (AnyRunning(role)) poll(nullptr, 0, 5);
  }
}

}  // namespace axlecast
