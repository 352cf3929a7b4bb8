#include "tests/support/scripted_frame_link.h"

#include <algorithm>

namespace axlecast {

void ScriptedFrameLink::RefuseOpens(int times, std::string problem) {
  refusals_ = times;
  refusal_ = std::move(problem);
}

void ScriptedFrameLink::Arrive(MonoNs at, const CanFrame& frame, bool own) {
  arrivals_.emplace(at, Arrival{frame, own});
}

// The frame is on the bus at `at`, acknowledged.
void ScriptedFrameLink::Deliver(const CanFrame& frame, MonoNs at) {
  Arrive(at, frame, true);
  if (!peer_) return;
  for (const Answer& answer : peer_(frame)) Arrive(at + answer.after, answer.frame, false);
}

void ScriptedFrameLink::Hear() {
  deaf_ = false;
  for (const CanFrame& frame : std::exchange(pending_, {})) Deliver(frame, clock_.Now() + send_time_);
}

Result<> ScriptedFrameLink::Open() {
  open_times_.push_back(clock_.Now());
  if (refusals_ > 0) {
    --refusals_;
    return Failure(refusal_);
  }
  if (lost_at_ <= clock_.Now()) lost_at_ = kNever;
  // A socket receives nothing from before it was opened.
  arrivals_.erase(arrivals_.begin(), arrivals_.lower_bound(clock_.Now()));
  open_ = true;
  return {};
}

FrameLink::SendResult ScriptedFrameLink::Send(const CanFrame& frame) {
  if (Gone()) return SendResult::kLost;
  if (pending_.size() >= queue_) {
    ++refused_sends_;
    return SendResult::kFull;
  }
  sent_.push_back(frame);
  send_times_.push_back(clock_.Now());
  if (deaf_) {
    pending_.push_back(frame);
  } else {
    Deliver(frame, clock_.Now() + send_time_);
  }
  return SendResult::kQueued;
}

FrameLink::Status ScriptedFrameLink::Receive(Received& received) {
  if (Gone()) return Status::kLost;
  if (NextArrival() > clock_.Now()) return Status::kTimeout;
  const auto first = arrivals_.begin();
  received = {.frame = first->second.frame, .at = {first->first, first->first}, .own = first->second.own};
  arrivals_.erase(first);
  return Status::kOk;
}

CanController ScriptedFrameLink::Controller() {
  CanController controller = controller_;
  controller.queue_full += refused_sends_;
  return controller;
}

FrameLink::Status ScriptedFrameLink::Wait(MonoNs until) {
  ++waits_;
  if (woken_.exchange(false)) return Status::kWoken;
  const MonoNs wake = wakes_.empty() ? kNever : *wakes_.begin();
  const MonoNs next = std::min({until, wake, open_ ? std::min(NextArrival(), lost_at_) : kNever});
  clock_.MoveTo(std::max(clock_.Now(), next));
  if (open_ && Gone()) return Status::kLost;
  if (wake <= clock_.Now()) {
    wakes_.erase(wakes_.begin());
    return Status::kWoken;
  }
  return open_ && NextArrival() <= clock_.Now() ? Status::kOk : Status::kTimeout;
}

}  // namespace axlecast
