#include "tests/support/simulator_frame_link.h"

#include <algorithm>

namespace axlecast {

Result<> SimulatorFrameLink::Open() {
  if (!plugged()) {
    queue_.Clear();
    return Failure("unplugged: plug it in");
  }
  open_ = true;
  received_.clear();
  queue_.Open();
  simulator_.OnBaud(bitrate_);
  return {};
}

void SimulatorFrameLink::Close() {
  open_ = false;
  queue_.Close();
}

FrameLink::SendResult SimulatorFrameLink::Send(const CanFrame& frame) {
  if (Gone()) return SendResult::kLost;
  CountWrite();
  const bool first = queue_.empty();
  const SendResult result = queue_.Add(frame);
  if (first) SendWaiting();
  return result;
}

void SimulatorFrameLink::SendWaiting() {
  queue_.Send(
      simulator_, clock_.Now(), [this](const CanFrame& frame, bool own) { ArriveFrame(frame, own); }, Arrive());
}

void SimulatorFrameLink::ArriveFrame(const CanFrame& frame, bool own) {
  if (!Gone()) received_.push_back({.frame = frame, .at = {clock_.Now(), clock_.Now()}, .own = own});
}

Simulator::Transmit SimulatorFrameLink::Arrive() {
  return [this](Bytes packet) {
    std::optional<CanFrame> frame = FromPacket(packet);
    if (!frame) return;
    const auto data = Damaged(frame->data);
    if (!data) return;
    frame->data = InlineBytes<kMaxCanData>(Bytes(*data).first(std::min(data->size(), kMaxCanData)));
    ArriveFrame(*frame, false);
  };
}

FrameLink::Status SimulatorFrameLink::Receive(Received& received) {
  if (Gone()) return Status::kLost;
  if (received_.empty()) return Status::kTimeout;
  received = received_.front();
  received_.pop_front();
  return Status::kOk;
}

CanController SimulatorFrameLink::Controller() { return queue_.Controller(!Gone(), bitrate_); }

FrameLink::Status SimulatorFrameLink::Wait(MonoNs until) {
  CountWait(clock_.Now());
  if (open_ && !plugged()) return Status::kLost;
  RunUntil(until);
  return received_.empty() || !open_ ? Status::kTimeout : Status::kOk;
}

// Until then, or until a frame has come.
void SimulatorFrameLink::RunUntil(MonoNs until) {
  while (received_.empty() || !open_) {
    const MonoNs again = queue_.empty() ? kNever : clock_.Now() + CanTransmitQueue::kSendAgain;
    const MonoNs due = std::min(simulator_.NextDue(), again);
    if (due > until) break;
    clock_.MoveTo(std::max(clock_.Now(), due));
    if (simulator_.NextDue() <= clock_.Now()) simulator_.OnDue(clock_.Now(), Arrive());
    SendWaiting();
  }
  if (received_.empty() || !open_) clock_.MoveTo(std::max(clock_.Now(), until));
}

}  // namespace axlecast
