#include "tools/axlecast/run/simulated_interface.h"

namespace axlecast {
namespace {

constexpr MonoNs kReopen = 100 * kMillisecond;

}  // namespace

std::string SimulatedInterface::Plug() {
  Unplug();
  std::string problem = socket_.Open();
  if (!problem.empty()) return problem;
  bitrate_ = socket_.Controller().bitrate;
  TellBaud();
  return "";
}

void SimulatedInterface::Unplug() {
  socket_.Close();
  bitrate_ = 0;
  reopen_at_ = kNever;
}

void SimulatedInterface::Serve() {
  if (reopen_at_ <= Now() && !Plug().empty()) reopen_at_ = Now() + kReopen;
  if (!socket_.IsOpen()) return;
  FrameLink::Received received;
  FrameLink::Status status = socket_.Receive(received);
  for (; status == FrameLink::Status::kOk; status = socket_.Receive(received)) {
    if (received.own || (received.frame.id & kCanError) != 0) continue;
    // Acknowledged it is already.
    static_cast<void>(simulator().OnFrame(received.frame, Now(), [this](Bytes bytes) { Transmit(bytes); }));
  }
  if (status != FrameLink::Status::kLost) return;
  Unplug();
  reopen_at_ = Now() + kReopen;
}

void SimulatedInterface::Transmit(Bytes bytes) {
  const std::optional<CanFrame> frame = FromPacket(bytes);
  // A full queue loses it, as a node's own would.
  if (frame && socket_.IsOpen()) static_cast<void>(socket_.Send(*frame));
}

}  // namespace axlecast
