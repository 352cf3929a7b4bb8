#include "drivers/hal/line_reader.h"

#include <unistd.h>

#include <cerrno>

#include "platform/os/system_clock.h"

namespace axlecast {

using ReadResult = ByteLink::ReadResult;
using Status = ByteLink::Status;

Result<> LineReader::CheckReady() const {
  if (wake_.valid()) return {};
  return Failure("no event can be created: the process has too many files open (ulimit -n)");
}

ReadResult LineReader::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (!IsAttached()) return {Status::kLost, 0};
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
