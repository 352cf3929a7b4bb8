#include "tests/support/simulator_frame_link.h"

#include <algorithm>
#include <vector>

namespace axlecast {
namespace {

constexpr std::size_t kQueue = 11;  // the frame in the controller, and ten in the interface's queue
constexpr MonoNs kSendAgain = kMillisecond;

}  // namespace

Result<> SimulatorFrameLink::Open() {
  if (!plugged()) {
    waiting_.clear();
    return Failure("unplugged: plug it in");
  }
  open_ = true;
  received_.clear();
  counts_ = {};
  simulator_.OnBaud(bitrate_);
  return {};
}

void SimulatorFrameLink::Close() {
  open_ = false;
  for (Waiting& waiting : waiting_) waiting.own = false;
}

FrameLink::SendResult SimulatorFrameLink::Send(const CanFrame& frame) {
  if (Gone()) return SendResult::kLost;
  CountWrite();
  if (waiting_.size() >= kQueue) {
    ++counts_.queue_full;
    return SendResult::kFull;
  }
  ++counts_.pending;
  waiting_.push_back({.frame = frame});
  if (waiting_.size() == 1) SendWaiting();
  return SendResult::kQueued;
}

void SimulatorFrameLink::SendWaiting() {
  while (!waiting_.empty() && Offer(waiting_.front())) waiting_.pop_front();
}

bool SimulatorFrameLink::Offer(Waiting& waiting) {
  std::vector<CanPacket> answers;  // come after what they answer
  const auto answer = [&answers](Bytes bytes) { answers.emplace_back(bytes); };
  const bool acknowledged = simulator_.OnFrame(waiting.frame, clock_.Now(), answer);
  if (acknowledged) ArriveFrame(waiting.frame, waiting.own);
  if (acknowledged && waiting.own) --counts_.pending;
  if (!acknowledged && waiting.own && !waiting.tried) ++counts_.unacknowledged;
  waiting.tried = true;
  for (const CanPacket& packet : answers) Arrive()(packet);
  return acknowledged;
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

CanController SimulatorFrameLink::Controller() {
  CanController controller = counts_;
  if (Gone()) return controller;
  const bool unheard = !waiting_.empty();
  controller.state = unheard ? CanController::State::kPassive : CanController::State::kActive;
  controller.tec = unheard ? 128 : 0;
  controller.rec = 0;
  controller.bitrate = bitrate_;
  return controller;
}

FrameLink::Status SimulatorFrameLink::Wait(MonoNs until) {
  CountWait(clock_.Now());
  if (open_ && !plugged()) return Status::kLost;
  RunUntil(until);
  return received_.empty() || !open_ ? Status::kTimeout : Status::kOk;
}

// Until then, or until a frame has come.
void SimulatorFrameLink::RunUntil(MonoNs until) {
  while (received_.empty() || !open_) {
    const MonoNs again = waiting_.empty() ? kNever : clock_.Now() + kSendAgain;
    const MonoNs due = std::min(simulator_.NextDue(), again);
    if (due > until) break;
    clock_.MoveTo(std::max(clock_.Now(), due));
    if (simulator_.NextDue() <= clock_.Now()) simulator_.OnDue(clock_.Now(), Arrive());
    SendWaiting();
  }
  if (received_.empty() || !open_) clock_.MoveTo(std::max(clock_.Now(), until));
}

}  // namespace axlecast
