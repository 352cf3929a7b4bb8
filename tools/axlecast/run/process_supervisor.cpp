#include "tools/axlecast/run/process_supervisor.h"

#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

constexpr MonoNs kFirstBackOff = 500 * kMillisecond;
constexpr MonoNs kLongestBackOff = 10 * kSecond;
constexpr MonoNs kRanWell = 30 * kSecond;
constexpr MonoNs kPatience = 3 * kSecond;
constexpr MonoNs kRecorderPatience = 60 * kSecond;  // it writes what waits in its memory, on any disk
constexpr std::size_t kDeathsKept = 1000;

std::string Seconds(MonoNs time) { return std::to_string(time / kSecond) + (time % kSecond == 0 ? " s" : ".5 s"); }

}  // namespace

ProcessSupervisor::ProcessSupervisor(std::string log_directory, const Clock& clock,
                                     std::function<void(const std::string& line)> tell)
    : log_directory_(std::move(log_directory)), clock_(clock), tell_(std::move(tell)) {}

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
  const std::string problem = member.child.Start(member.argv, member.log.FileDescriptor());
  if (problem.empty()) {
    member.log.Write("== started, process " + std::to_string(member.child.pid()));
  } else {
    OnEnd(member, problem);
  }
}

void ProcessSupervisor::OnEnd(Member& member, const std::string& how) {
  const MonoNs now = clock_.Now();
  member.back_off = now - member.started >= kRanWell || member.back_off == 0
                        ? kFirstBackOff
                        : std::min(2 * member.back_off, kLongestBackOff);
  member.restart_at = now + member.back_off;
  if (deaths_.size() < kDeathsKept) {
    const bool by_itself = how.starts_with("exit code") && !member.last_words.empty();
    deaths_.push_back(member.name + ": " + how + (by_itself ? ": " + member.last_words : ""));
  }
  member.last_words.clear();
  member.log.Write("== ended: " + how);
  tell_(member.name + " ended: " + how + "; starting it again in " + Seconds(member.back_off));
}

void ProcessSupervisor::ReadLog(Member& member) {
  for (const std::string& line : member.child.ReadLines()) {
    member.log.Write(line);
    if (!WorthShowing(line)) continue;
    member.last_words = line;
    tell_(member.name + ": " + line);
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

// Its exit code tells of what it could not do, as that of the bridge to a broker that never took anything.
void ProcessSupervisor::OnStopped(Member& member, const ChildProcess::End& end) {
  member.log.Write("== ended: " + end.text);
  if (end.clean || !end.text.starts_with("exit code") || deaths_.size() >= kDeathsKept) return;
  deaths_.push_back(member.name + ": " + end.text + " at its end: " + member.log.path() + " says why");
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
  const MonoNs patience_ends = clock_.Now() + (role == Role::kRecorder ? kRecorderPatience : kPatience);
  bool killed = false;
  while (AnyRunning(role)) {
    const bool out_of_patience = clock_.Now() >= patience_ends || hurry();
    for (Member& member : members_) {
      if (out_of_patience && !killed && member.role == role && member.child.running()) {
        tell_(member.name + " does not end: killed");
        member.child.Signal(SIGKILL);
      }
      // The others' output is read too, so that none of them waits for us.
      ReadLog(member);
      if (member.role != role) continue;
      if (const auto end = member.child.Reap()) {
        ReadLog(member);
        OnStopped(member, *end);
      }
    }
    killed = killed || out_of_patience;
    if (AnyRunning(role)) poll(nullptr, 0, 5);
  }
}

}  // namespace axlecast
