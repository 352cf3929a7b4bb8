#include "tests/support/simulator_link.h"

#include <algorithm>

namespace axlecast {

Result<> SimulatorLink::Open() {
  if (!plugged()) return Failure("unplugged: plug it in");
  open_ = true;
  received_.clear();
  simulator_.OnBaud(baud_);
  return {};
}

bool SimulatorLink::SetBaud(std::int64_t baud) {
  if (Gone()) return false;
  simulator_.OnBaud(baud);
  return true;
}

bool SimulatorLink::Write(Bytes bytes) {
  if (Gone()) return false;
  CountWrite();
  simulator_.OnBytes(bytes, clock_.Now(), Receive());
  return true;
}

ByteLink::ReadResult SimulatorLink::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (Gone()) return {.status = Status::kLost, .count = 0};
  RunUntil(deadline);
  return ReadNow(into);
}

ByteLink::ReadResult SimulatorLink::ReadNow(std::span<std::uint8_t> into) {
  if (Gone()) return {.status = Status::kLost, .count = 0};
  const std::size_t count = std::min(into.size(), received_.size());
  const auto end = received_.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(received_.begin(), end, into.begin());
  received_.erase(received_.begin(), end);
  return {.status = count > 0 ? Status::kOk : Status::kTimeout, .count = count};
}

ByteLink::Status SimulatorLink::Wait(MonoNs until) {
  CountWait(clock_.Now());
  if (open_ && !plugged()) return Status::kLost;
  RunUntil(until);
  return received_.empty() || !open_ ? Status::kTimeout : Status::kOk;
}

bool SimulatorLink::Pulse(std::uint8_t line, MonoNs low) {
  if (Gone()) return false;
  clock_.Advance(low);
  simulator_.OnPulse(line, low, clock_.Now(), Receive());
  return true;
}

Simulator::Transmit SimulatorLink::Receive() {
  return [this](Bytes bytes) {
    if (Gone()) return;
    const auto arrived = Damaged(bytes);
    if (arrived) received_.insert(received_.end(), arrived->begin(), arrived->end());
  };
}

// Until then, or until bytes have come.
void SimulatorLink::RunUntil(MonoNs until) {
  while (received_.empty() || !open_) {
    const MonoNs due = simulator_.NextDue();
    if (due > until) break;
    clock_.MoveTo(std::max(clock_.Now(), due));
    simulator_.OnDue(clock_.Now(), Receive());
  }
  if (received_.empty() || !open_) clock_.MoveTo(std::max(clock_.Now(), until));
}

}  // namespace axlecast
