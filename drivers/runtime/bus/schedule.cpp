#include "drivers/runtime/bus/schedule.h"

#include <algorithm>

namespace axlecast {
namespace {

constexpr std::size_t kSilenceRank = 0;
constexpr std::size_t kFirstRank = 1;  // of Priority::kStop
constexpr std::size_t kLiveRank = kFirstRank + static_cast<std::size_t>(Priority::kLive);
constexpr std::size_t kListenRank = 6;
constexpr std::size_t kIdleRank = 7;

std::size_t RankOf(const Step& step) {
  if (std::holds_alternative<Idle>(step.action)) return kIdleRank;
  if (std::holds_alternative<Listen>(step.action)) return kListenRank;
  if (std::holds_alternative<Silence>(step.action)) return kSilenceRank;
  return kFirstRank + static_cast<std::size_t>(step.priority);
}

}  // namespace

void Schedule::Add(Device& device) {
  entries_.push_back({.device = &device, .slots = SlotClock(settings_.period, settings_.phase)});
}

void Schedule::Start(MonoNs now) {
  for (Entry& entry : entries_) {
    entry.slots.Start(now);
    entry.timeouts = 0;
    entry.paused_until = 0;
    entry.free_at = 0;
  }
  free_at_ = 0;
}

const Schedule::Choice& Schedule::Choose(MonoNs now) {
  if (now < free_at_) {
    choice_ = {.device = 0, .step = {.action = Idle{free_at_}}, .until = free_at_, .live = false};
    return choice_;
  }
  if (ReservedTurn(now)) return choice_;
  choice_.until = kNever;
  Best best;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& entry = entries_[i];
    Consider(i, now, now >= entry.paused_until && entry.slots.Due(now), best);
  }
  if (best.rank >= kIdleRank) choice_.step.action = Idle{choice_.until};
  return choice_;
}

// Offers nobody a live slot, to see whether a slower item waits. False when none does.
bool Schedule::ReservedTurn(MonoNs now) {
  if (turns_ % settings_.reserve_every != settings_.reserve_every - 1) return false;
  choice_.until = kNever;
  Best best;
  for (std::size_t i = 0; i < entries_.size(); ++i) Consider(i, now, false, best);
  if (best.rank < kListenRank) return true;
  ++turns_;
  return false;
}

void Schedule::Consider(std::size_t index, MonoNs now, bool live_due, Best& best) {
  Entry& entry = entries_[index];
  if (now < entry.free_at) {
    choice_.until = std::min(choice_.until, entry.free_at);
    return;
  }
  const Step step = entry.device->Next({.now = now, .live_due = live_due});
  const std::size_t rank = RankOf(step);
  AskAgain(entry, step, now, live_due);
  // A silent device may be stopped, commanded and cleared up after; its readings wait for the end of the pause.
  if (now < entry.paused_until && rank >= kLiveRank && rank < kListenRank) return;
  if (rank > best.rank || rank >= kIdleRank) return;
  const auto* listen = std::get_if<Listen>(&step.action);
  if (listen != nullptr && rank == best.rank && listen->until >= best.until) return;
  const std::size_t first = next_[rank];
  const std::size_t distance = index >= first ? index - first : index + entries_.size() - first;
  if (listen == nullptr && rank == best.rank && distance >= best.distance) return;
  best = {.rank = rank, .distance = distance, .until = listen == nullptr ? kNever : listen->until};
  rank_ = rank;
  choice_.device = index;
  choice_.step = step;
  choice_.live = live_due && rank == kLiveRank;
}

void Schedule::AskAgain(Entry& entry, const Step& step, MonoNs now, bool live_due) {
  if (!live_due) choice_.until = std::min(choice_.until, std::max(entry.slots.next(), entry.paused_until));
  const Idle* idle = std::get_if<Idle>(&step.action);
  if (idle == nullptr) return;
  const MonoNs until = std::max(idle->until, now + kShortestIdle);
  if (live_due) entry.slots.Excuse(until);
  choice_.until = std::min(choice_.until, until);
}

void Schedule::Started(MonoNs now) {
  ++turns_;
  next_[rank_] = choice_.device + 1 < entries_.size() ? choice_.device + 1 : 0;
  if (choice_.live) entries_[choice_.device].slots.Take(now);
}

void Schedule::Ended(std::size_t device, const Event& event, MonoNs now) {
  Entry& entry = entries_[device];
  Pace(entry, event);
  if (event.kind != Event::Kind::kTimeout || !event.bytes.empty()) {
    entry.timeouts = 0;
    return;
  }
  if (++entry.timeouts < settings_.silent_after) return;
  const int doublings = std::min(entry.timeouts - settings_.silent_after, 30);
  const MonoNs cost = now + settings_.pacing.after_reply - event.sent.first;
  entry.paused_until = now + std::max(std::min(settings_.pause_first << doublings, settings_.pause_most),
                                      settings_.pause_costs * cost);
  entry.slots.Excuse(entry.paused_until);
}

void Schedule::Pace(Entry& entry, const Event& event) {
  const Pacing& pacing = settings_.pacing;
  const MonoNs request_end =
      std::max(event.sent.last, event.sent.first + settings_.line.WireTime(event.request.size()));
  free_at_ = std::max(request_end + pacing.after_request, event.received.last + pacing.after_reply);
  if (pacing == Pacing{}) free_at_ = 0;
  entry.free_at = pacing.unit_after_reply > 0 ? event.received.last + pacing.unit_after_reply : 0;
}

std::int64_t Schedule::late() const {
  std::int64_t sum = 0;
  for (const Entry& entry : entries_) sum += entry.slots.late();
  return sum;
}

}  // namespace axlecast
