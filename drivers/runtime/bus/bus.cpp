#include "drivers/runtime/bus/bus.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

// Reads that empty the line before a request that does not wait for an idle line; more bytes come meanwhile.
constexpr int kReadsBeforeTransmitting = 4;

std::unique_ptr<Transactor> MakeTransactor(const BusSettings& settings, ByteLink& link, const Clock& clock,
                                           BusObserver& observer) {
  auto transactor = std::make_unique<SerialTransactor>(link, clock, settings.echo, settings.lines, settings.wire);
  transactor->NotifyTransmitted([&observer] { observer.OnWait(); });
  return transactor;
}

}  // namespace

Bus::Bus(const BusSettings& settings, Link& link, std::unique_ptr<Transactor> transactor, const Clock& clock,
         BusObserver& observer, WireLog* wire)
    : settings_(settings),
      link_(link),
      clock_(clock),
      observer_(observer),
      wire_(wire),
      transactor_(std::move(transactor)),
      guard_(std::make_unique<StaleReplyGuard>(settings.late)),
      schedule_(settings.schedule, guard_.get()),
      reopen_pause_(settings.reopen_first) {}

Bus::Bus(const BusSettings& settings, ByteLink& link, const Clock& clock, BusObserver& observer, WireLog* wire)
    : Bus(settings, link, MakeTransactor(settings, link, clock, observer), clock, observer, wire) {}

Bus::Bus(const BusSettings& settings, FrameLink& link, const Clock& clock, BusObserver& observer, WireLog* wire)
    : Bus(settings, link, std::make_unique<CanTransactor>(link, clock), clock, observer, wire) {}

MonoNs Bus::RunOnce(MonoNs by) {
  if (!up_) {
    observer_.OnWait();
    return Reopen(by);
  }
  const MonoNs now = clock_.Now();
  const Schedule::Choice& choice = schedule_.Choose(now);
  if (std::holds_alternative<Exchange>(choice.step.action)) return Transmit(choice, now);

  observer_.OnWait();
  by = std::min(by, choice.until);
  if (wire_ != nullptr) {
    wire_->FlushIfDue(now);
    by = std::min(by, wire_->due());
  }
  return CarryOut(choice, now, by);
}

void Bus::Start(const Schedule::Choice& choice, MonoNs now) {
  const std::int64_t tick = schedule_.Started(now);
  if (choice.live) {
    const auto* send = std::get_if<Send>(&choice.step.action);
    observer_.OnSlot(send != nullptr && send->for_all ? BusObserver::kAllDevices : choice.device, tick);
  }
  schedule_.device(choice.device).OnStarted(choice.step, now);
}

MonoNs Bus::CarryOut(const Schedule::Choice& choice, MonoNs now, MonoNs by) {
  const bool waits =
      std::holds_alternative<Idle>(choice.step.action) || std::holds_alternative<Listen>(choice.step.action);
  if (!waits) Start(choice, now);
  return Deliver(transactor_->Run(choice.step, by), choice.device, now);
}

MonoNs Bus::Transmit(const Schedule::Choice& choice, MonoNs now) {
  const bool regardless = std::get<Exchange>(choice.step.action).regardless;
  for (int reads = 0; reads < kReadsBeforeTransmitting; ++reads) {
    const Event* stray = transactor_->FindStray();
    if (stray == nullptr) break;
    const bool lost = stray->kind == Event::Kind::kLinkDown;
    const MonoNs after = Deliver(stray, choice.device, now);
    if (lost || !regardless) return after;
  }
  Start(choice, now);
  const Event* event = transactor_->Run(choice.step, now);
  guard_->Ended(std::get<Exchange>(choice.step.action), choice.device, *event);
  if (event->kind != Event::Kind::kLinkDown) {
    ++exchanges_;
    if (event->kind == Event::Kind::kReply) {
      stats_.Add(event->received.last - event->sent.first);
      times_.Add(event->received.last - event->sent.first);
    }
    schedule_.Ended(choice.device, *event, event->received.last);
  }
  return Deliver(event, choice.device, now);
}

MonoNs Bus::Deliver(const Event* event, std::size_t device, MonoNs now) {
  if (event == nullptr) return clock_.Now();
  const bool of_bus = Event::IsOfBus(event->kind);
  if (wire_ != nullptr) {
    Event whose = *event;
    whose.device = of_bus ? -1 : static_cast<int>(device);
    wire_->Record(whose);
  }
  if (event->kind == Event::Kind::kUnexpectedBytes && !event->early && !event->secret)
    guard_->CameUnexpected(event->bytes, event->received.last);
  if (event->kind == Event::Kind::kFrame && (event->id & kCanError) == 0) ++exchanges_;
  if (event->kind == Event::Kind::kLinkDown) {
    Down(*event);
  } else if (of_bus) {
    DeliverToAll(*event);
  } else {
    schedule_.device(device).On(*event);
  }
  return std::max(now, event->received.last);
}

MonoNs Bus::Reopen(MonoNs by) {
  MonoNs now = clock_.Now();
  if (now < reopen_at_) {
    // The line is closed, so only the time matters. The caller handles what it was woken for.
    static_cast<void>(link_.Wait(std::min(reopen_at_, by)));
    return clock_.Now();
  }
  Result<> opened = OpenAll();
  now = clock_.Now();
  if (opened) {
    up_ = true;
    up_since_ = now;
    ++opens_;
    schedule_.Start(now);
    guard_->Start(now);
    const Event event{.kind = Event::Kind::kLinkUp, .sent = {}, .received = {now, now}, .request = {}, .bytes = {}};
    if (wire_ != nullptr) wire_->Record(event);
    observer_.OnLink(true, "", now);
    DeliverToAll(event);
    return now;
  }
  Pause(now);
  if (opened.error().text != problem_) {
    problem_ = std::move(opened.error().text);
    observer_.OnLink(false, problem_, now);
  }
  return now;
}

void Bus::Pause(MonoNs now) {
  reopen_at_ = now + reopen_pause_;
  reopen_pause_ = std::min(2 * reopen_pause_, settings_.reopen_max);
}

Result<> Bus::OpenAll() {
  if (settings_.lines == nullptr) return link_.Open();
  return settings_.lines->Open().and_then([this] { return link_.Open(); });
}

void Bus::Down(const Event& event) {
  const MonoNs now = event.received.last;
  closed_errors_ = LineErrors();
  link_.Close();
  if (settings_.lines != nullptr) settings_.lines->Close();
  up_ = false;
  ++losses_;
  // The back-off restarts only if the line stayed open longer than reopen_max.
  if (now - up_since_ > settings_.reopen_max) reopen_pause_ = settings_.reopen_first;
  Pause(now);
  problem_ = "the line was lost: adapter unplugged, or the simulator stopped; it is opened again by itself";
  if (wire_ != nullptr) wire_->Flush();
  observer_.OnLink(false, problem_, now);
  DeliverToAll(event);
}

void Bus::DeliverToAll(const Event& event) {
  for (std::size_t i = 0; i < schedule_.size(); ++i) schedule_.device(i).On(event);
}

Link::LineErrors Bus::LineErrors() const {
  if (!up_) return closed_errors_;
  const Link::LineErrors now = link_.Errors();
  return {closed_errors_.framing + now.framing, closed_errors_.dropped + now.dropped};
}

Bus::Counters Bus::counters() const {
  return {.exchanges = exchanges_,
          .losses = losses_,
          .reopens = std::max<std::int64_t>(0, opens_ - 1),
          .line = LineErrors()};
}

}  // namespace axlecast
