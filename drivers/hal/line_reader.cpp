#include "drivers/hal/line_reader.h"

#include <unistd.h>

#include <cerrno>
#include <utility>

#include "platform/os/call_timer.h"
#include "platform/os/system_clock.h"

namespace axlecast {

using ReadResult = ByteLink::ReadResult;
using Status = ByteLink::Status;

namespace {

// The timer's signal costs as much as a few system calls: so many reads at least have to share one.
constexpr int kReadsPerSignal = 8;

}  // namespace

Result<> LineReader::CheckReady() const {
  if (wake_.valid()) return {};
  return Failure("no event can be created: the process has too many files open (ulimit -n)");
}

ReadResult LineReader::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (!IsAttached()) return {Status::kLost, 0};
  if (TimerPays(deadline)) {
    if (const auto result = ReadBlocking(into, deadline)) return *result;
  }
  while (true) {
    pollfd readable{fd_, POLLIN, 0};
    const int ready = PollUntil({&readable, 1}, deadline, clock_);
    if (ready == 0) return {Status::kTimeout, 0};
    if (ready < 0) return {Status::kLost, 0};
    // Bytes that came before a hang-up can still be read.
    const ReadResult result = ReadNow(into);
    if (result.status != Status::kTimeout) return result;
    if ((readable.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return {Status::kLost, 0};
  }
}

bool LineReader::TimerPays(MonoNs deadline) {
  if (blocking_fd_ < 0) return false;
  if (CallTimer::OfThisThread().IsSet(deadline)) return true;
  const MonoNs now = clock_.Now();
  return now - std::exchange(last_began_, now) < (deadline - now) / kReadsPerSignal;
}

// Returns nothing if the thread has no timer.
std::optional<ReadResult> LineReader::ReadBlocking(std::span<std::uint8_t> into, MonoNs deadline) {
  CallTimer& timer = CallTimer::OfThisThread();
  std::optional<ReadResult> result;
  while (!result && timer.Set(deadline, clock_)) {
    const ssize_t count = read(blocking_fd_, into.data(), into.size());
    if (count > 0) {
      result = {Status::kOk, static_cast<std::size_t>(count)};
    } else if (count == 0 || errno != EINTR) {
      result = {Status::kLost, 0};  // 0: hung up
    } else if (clock_.Now() >= deadline) {
      result = {Status::kTimeout, 0};
    }
  }
  timer.Clear();
  return result;
}

ReadResult LineReader::ReadNow(std::span<std::uint8_t> into) {
  if (into.empty()) return {Status::kTimeout, 0};
  while (true) {
    const ssize_t count = read(fd_, into.data(), into.size());
    if (count > 0) return {Status::kOk, static_cast<std::size_t>(count)};
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) return {Status::kTimeout, 0};
    return {Status::kLost, 0};  // 0: hung up
  }
}

Status LineReader::Wait(MonoNs until) {
  std::array<pollfd, 2> lines{{{wake_.FileDescriptor(), POLLIN, 0}, {fd_, POLLIN, 0}}};  // poll ignores fd -1
  const int ready = PollUntil(lines, until, clock_);
  if (ready < 0) return Status::kLost;
  if ((lines[0].revents & POLLIN) != 0 && wake_.Take()) return Status::kWoken;
  if ((lines[1].revents & POLLIN) != 0) return Status::kOk;
  if (lines[1].revents != 0) return Status::kLost;
  return Status::kTimeout;
}

bool LineReader::WaitWritable(MonoNs deadline) {
  pollfd writable{fd_, POLLOUT, 0};
  return IsAttached() && PollUntil({&writable, 1}, deadline, clock_) > 0 &&
         (writable.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
}

}  // namespace axlecast
