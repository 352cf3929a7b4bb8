#include "drivers/runtime/bus/transactor.h"

#include <algorithm>

namespace axlecast {

using Status = Link::Status;

const Event* CanTransactor::Run(const Step& step, MonoNs by) {
  if (const auto* send = std::get_if<Send>(&step.action)) return Transmit(send->frame);
  if (std::holds_alternative<Idle>(step.action)) return Receive(by);
  const auto* listen = std::get_if<Listen>(&step.action);
  if (listen == nullptr) return Ended(Event::Kind::kLinkDown, {clock_.Now(), clock_.Now()});
  const MonoNs since = clock_.Now();
  const Event* event = Receive(std::min(listen->until, by));
  if (event != nullptr) return event;
  const MonoNs now = clock_.Now();
  return now >= listen->until ? Ended(Event::Kind::kSilent, {since, now}) : nullptr;
}

const Event* CanTransactor::Transmit(const CanFrame& frame) {
  Interval at{clock_.Now(), 0};
  const FrameLink::SendResult result = link_.Send(frame);
  at.last = clock_.Now();
  if (result == FrameLink::SendResult::kLost) return Ended(Event::Kind::kLinkDown, at);
  const bool queued = result == FrameLink::SendResult::kQueued;
  static_cast<void>(Ended(queued ? Event::Kind::kSent : Event::Kind::kNotSent, at));
  event_.id = frame.id;
  event_.bytes = frame.data;
  return &event_;
}

const Event* CanTransactor::Receive(MonoNs by) {
  Status status = link_.Receive(received_);
  if (status == Status::kTimeout) {
    status = link_.Wait(by);
    if (status == Status::kOk) status = link_.Receive(received_);
  }
  if (status == Status::kLost) return Ended(Event::Kind::kLinkDown, {clock_.Now(), clock_.Now()});
  return status == Status::kOk ? Arrived() : nullptr;
}

const Event* CanTransactor::Arrived() {
  static_cast<void>(Ended(received_.own ? Event::Kind::kConfirmed : Event::Kind::kFrame, received_.at));
  event_.id = received_.frame.id;
  event_.bytes = received_.frame.data;
  return &event_;
}

const Event* CanTransactor::Ended(Event::Kind kind, Interval at) {
  event_ = {.kind = kind, .sent = {}, .received = at, .request = {}, .bytes = {}};
  return &event_;
}

namespace {

constexpr MonoNs kLook = 50 * kMillisecond;  // how soon a stop is noticed if nothing comes

constexpr std::size_t kTheProbe = 0;  // the guard's only device

// Before a request is sent, no bytes may be unread, and no late reply may be possible that looks like its reply.
const Event* Carry(const Step& step, Transactor& transactor, StaleReplyGuard& guard, MonoNs now) {
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return transactor.Run(step, now + kLook);
  if (const Event* stray = transactor.FindStray()) return stray;
  const MonoNs free_at = guard.FreeAt(*exchange, now);
  if (free_at > now) return transactor.Run(Step{.action = Idle{free_at}}, std::min(free_at, now + kLook));
  const Event* event = transactor.Run(step, now + kLook);
  guard.Ended(*exchange, kTheProbe, *event);
  return event;
}

}  // namespace

bool RunProbe(Probe& probe, Transactor& transactor, const Clock& clock, StaleReplyGuard& guard,
              const std::function<bool()>& stop) {
  while (!stop()) {
    const MonoNs now = clock.Now();
    const std::optional<Step> step = probe.Next(now);
    if (!step) return true;
    const Event* event = Carry(*step, transactor, guard, now);
    if (event == nullptr) continue;
    if (event->kind == Event::Kind::kUnexpectedBytes && !event->early)
      guard.CameUnexpected(event->bytes, event->received.last);
    probe.On(*event);
    if (event->kind == Event::Kind::kLinkDown) return false;
  }
  return true;
}

}  // namespace axlecast
