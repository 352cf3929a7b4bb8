#include "drivers/hal/serial_port.h"

#include <unistd.h>

#include <cerrno>
#include <utility>

namespace axlecast {

SerialPort::SerialPort(SerialSettings settings, const Clock& clock)
    : clock_(clock), tty_(std::move(settings), clock), reader_(clock) {}

SerialPort::~SerialPort() = default;

std::string SerialPort::Open() {
  Close();
  std::string problem = SetUp();
  if (problem.empty()) {
    reader_.Attach(tty_.FileDescriptor());
  } else {
    Close();
  }
  return problem;
}

std::string SerialPort::SetUp() {
  std::string problem = reader_.Problem();
  if (problem.empty()) problem = tty_.Claim();
  if (problem.empty()) problem = tty_.Exclude();
  if (problem.empty()) problem = tty_.SetFormat();
  if (problem.empty()) problem = tty_.StartAfresh();
  return problem;
}

void SerialPort::Close() {
  reader_.Detach();
  tty_.Release();
}

bool SerialPort::Write(Bytes bytes) {
  MonoNs give_up = 0;
  while (!bytes.empty()) {
    const ssize_t written = write(tty_.FileDescriptor(), bytes.data(), bytes.size());
    if (written > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      give_up = 0;
      continue;
    }
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno != EAGAIN) return false;
    if (give_up == 0) give_up = clock_.Now() + kWriteTimeout;
    if (!reader_.WaitWritable(give_up)) return false;
  }
  return true;
}

}  // namespace axlecast
