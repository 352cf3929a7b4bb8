#include "tests/support/simulator_spi_link.h"

#include <algorithm>
#include <vector>

namespace axlecast {
namespace {

constexpr std::uint8_t kRest = 0xFF;

}  // namespace

Result<> SimulatorSpiLink::Open() {
  if (!plugged()) return Failure("unplugged: plug it in");
  open_ = true;
  return {};
}

void SimulatorSpiLink::Close() {
  open_ = false;
  DropBytes();
}

bool SimulatorSpiLink::Write(Bytes bytes) {
  if (Gone() || bytes.size() > kMaxFrame) return false;
  CountWrite();
  const std::span<std::uint8_t> rx = Fill(bytes.size());
  const MonoNs first_edge = fake_clock_.Now();
  RunUntil(first_edge);
  simulator_.OnTransfer({.settings = settings_, .tx = bytes}, first_edge, rx);
  std::vector<std::uint8_t> seen = Damaged(rx).value_or(std::vector<std::uint8_t>());
  seen.resize(rx.size(), kRest);
  std::copy(seen.begin(), seen.end(), rx.begin());
  fake_clock_.MoveTo(first_edge + settings_.ClockTime(static_cast<std::int64_t>(rx.size()) * 8));
  return true;
}

ByteLink::ReadResult SimulatorSpiLink::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (!Gone() && !HasBytes()) RunUntil(deadline);
  return ReadNow(into);
}

ByteLink::ReadResult SimulatorSpiLink::ReadNow(std::span<std::uint8_t> into) {
  return Gone() ? ReadResult{Status::kLost, 0} : ClockedLink::ReadNow(into);
}

Link::Status SimulatorSpiLink::Wait(MonoNs until) {
  CountWait(fake_clock_.Now());
  if (open_ && !plugged()) return Status::kLost;
  if (HasBytes()) return Status::kOk;
  RunUntil(until);
  return Status::kTimeout;
}

void SimulatorSpiLink::RunUntil(MonoNs until) {
  while (simulator_.NextDue() <= until) {
    fake_clock_.MoveTo(std::max(fake_clock_.Now(), simulator_.NextDue()));
    simulator_.OnDue(fake_clock_.Now(), [](Bytes) {});  // it sends only while it is clocked
  }
  fake_clock_.MoveTo(std::max(fake_clock_.Now(), until));
}

}  // namespace axlecast
