#include "drivers/runtime/bus/schedule.h"

#include <algorithm>

namespace axlecast {

namespace {

constexpr std::size_t kRegardlessRank = 0;
constexpr std::size_t kSilenceRank = 1;
constexpr std::size_t kFirstRank = 2;  // of Priority::kStop
constexpr std::size_t kStopRank = kFirstRank + static_cast<std::size_t>(Priority::kStop);
constexpr std::size_t kCommandRank = kFirstRank + static_cast<std::size_t>(Priority::kCommand);
constexpr std::size_t kLiveRank = kFirstRank + static_cast<std::size_t>(Priority::kLive);
constexpr std::size_t kListenRank = 7;
constexpr std::size_t kIdleRank = 8;

// Slots of commands, for each device of the bus, after which a due reading goes first.
constexpr std::size_t kCommandSlots = 1;
constexpr std::size_t kStopSlots = 4;

std::size_t RankOf(const Step& step) {
  if (std::holds_alternative<Idle>(step.action)) return kIdleRank;
  if (std::holds_alternative<Listen>(step.action)) return kListenRank;
  if (std::holds_alternative<WaitForIdleLine>(step.action)) return kSilenceRank;
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange != nullptr && exchange->regardless) return kRegardlessRank;
  return kFirstRank + static_cast<std::size_t>(step.priority);
}

bool IsStop(std::size_t rank) { return rank == kRegardlessRank || rank == kStopRank; }
bool IsCommand(std::size_t rank) { return IsStop(rank) || rank == kCommandRank; }

}  // namespace

void Schedule::Add(Device& device) {
  entries_.push_back({.device = &device, .slots = SlotClock(settings_.ticks, settings_.base)});
  answering_ = entries_.size();
}

void Schedule::Start(MonoNs now) {
  for (Entry& entry : entries_) {
    entry.slots.Start(now);
    entry.timeouts = 0;
    entry.paused_until = 0;
    entry.soon_until = 0;
    entry.free_at = 0;
    entry.commands = 0;
  }
  answering_ = entries_.size();
  free_at_ = 0;
}

const Schedule::Choice& Schedule::Choose(MonoNs now) {
  if (now < free_at_) {
    choice_ = {.device = 0, .step = {.action = Idle{free_at_}}, .until = free_at_, .live = false};
    return choice_;
  }
  const Best best = Find(Look::kAll, now);
  if (best.rank >= kIdleRank) choice_.step.action = Idle{choice_.until};
  const bool slow_share = slots_ % settings_.reserve_every == settings_.reserve_every - 1;
  const bool shares = slow_share || IsCommand(best.rank);
  if (!shares || best.rank == kSilenceRank || best.rank >= kListenRank) return choice_;
  const Choice first = choice_;
  const std::size_t rank = rank_;
  if (TakeShare(best, now)) return choice_;
  choice_ = first;
  rank_ = rank;
  return choice_;
}

// Gives the slot to a slow item whose share is due, or to a reading that is overdue. Returns false if `best` keeps the slot.
bool Schedule::TakeShare(const Best& best, MonoNs now) {
  if (!IsStop(best.rank) && slots_ % settings_.reserve_every == settings_.reserve_every - 1) {
    if (Find(Look::kSlow, now).rank < kListenRank) return true;
    ++slots_;
  }
  const bool overdue =
      IsCommand(best.rank) && std::any_of(entries_.begin(), entries_.end(), [&](const Entry& entry) {
        return Overdue(entry, best.rank) && LiveDue(entry, now);
      });
  return overdue && Find(IsStop(best.rank) ? Look::kOverdueByStops : Look::kOverdue, now).rank == kLiveRank;
}

// If a whole bus becomes silent, its devices fail one after the other. A device that has failed does not count as answering
// while the others still fail. One lost reply is not sufficient.
int Schedule::FailuresOfTheMissing() const { return std::min(2, settings_.silent_after); }

bool Schedule::Overdue(const Entry& entry, std::size_t rank) const {
  return entry.commands >= (IsStop(rank) ? kStopSlots : kCommandSlots) * entries_.size();
}

// A silent device is polled rarely only while another device answers.
MonoNs Schedule::PausedUntil(const Entry& entry) const {
  return answering_ > 0 ? entry.paused_until : entry.soon_until;
}

bool Schedule::LiveDue(const Entry& entry, MonoNs now) const {
  return now >= PausedUntil(entry) && entry.slots.Due(now);
}

Schedule::Best Schedule::Find(Look look, MonoNs now) {
  choice_.until = kNever;
  Best best;
  for (std::size_t i = 0; i < entries_.size(); ++i) Consider(i, now, look, best);
  return best;
}

// Returns the next step of the device; Idle instead of an exchange whose reply could be confused with a late reply.
Step Schedule::Ask(const Entry& entry, MonoNs now, bool poll_due, bool reserved) const {
  Step step = entry.device->Next({.now = now, .poll_due = poll_due, .reserved = reserved, .pending = pending_});
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (pending_ == nullptr || exchange == nullptr || exchange->regardless) return step;
  const MonoNs free_at = pending_->FreeAt(*exchange, now);
  if (free_at > now) step.action = Idle{free_at};
  return step;
}

void Schedule::Consider(std::size_t index, MonoNs now, Look look, Best& best) {
  Entry& entry = entries_[index];
  if (now < entry.free_at) {
    choice_.until = std::min(choice_.until, entry.free_at);
    return;
  }
  const bool poll_due = look != Look::kSlow && LiveDue(entry, now);
  if (look == Look::kOverdue && !(poll_due && Overdue(entry, kCommandRank))) return;
  if (look == Look::kOverdueByStops && !(poll_due && Overdue(entry, kStopRank))) return;
  const Step step = Ask(entry, now, poll_due, look != Look::kAll);
  const std::size_t rank = RankOf(step);
  AskAgain(entry, step, now, poll_due);
  if (look == Look::kSlow ? rank <= kLiveRank : look != Look::kAll && rank != kLiveRank) return;
  // Stops and commands are sent to a silent device, and the line is emptied after it. Its readings wait for the end of the pause.
  if (now < PausedUntil(entry) && rank >= kLiveRank && rank < kListenRank) return;
  if (rank > best.rank || rank >= kIdleRank) return;
  const auto* listen = std::get_if<Listen>(&step.action);
  if (listen != nullptr && rank == best.rank && listen->until >= best.until) return;
  const std::int64_t asked = entry.asked[rank];
  if (listen == nullptr && rank == best.rank && asked >= best.asked) return;
  best = {.rank = rank, .asked = asked, .until = listen == nullptr ? kNever : listen->until};
  rank_ = rank;
  choice_.device = index;
  choice_.step = step;
  choice_.live = poll_due && rank == kLiveRank;
}

void Schedule::AskAgain(Entry& entry, const Step& step, MonoNs now, bool poll_due) {
  if (!poll_due) choice_.until = std::min(choice_.until, std::max(entry.slots.next(), PausedUntil(entry)));
  const Idle* idle = std::get_if<Idle>(&step.action);
  if (idle == nullptr) return;
  const MonoNs until = std::max(idle->until, now + kMinIdle);
  if (poll_due) entry.slots.Excuse(until);
  choice_.until = std::min(choice_.until, until);
}

std::int64_t Schedule::Started(MonoNs now) {
  ++slots_;
  entries_[choice_.device].asked[rank_] = slots_;
  if (IsCommand(rank_)) {
    for (Entry& entry : entries_) ++entry.commands;
  }
  if (!choice_.live) return kNoTick;
  entries_[choice_.device].commands = 0;
  return entries_[choice_.device].slots.Take(now);
}

void Schedule::Ended(std::size_t device, const Event& event, MonoNs now) {
  Entry& entry = entries_[device];
  Pace(entry, event);
  if (event.kind == Event::Kind::kTimeout && event.bytes.empty())
    OnSilent(entry, event, now);
  else
    OnAnswered(entry);
}

void Schedule::OnSilent(Entry& entry, const Event& event, MonoNs now) {
  if (++entry.timeouts == FailuresOfTheMissing()) --answering_;
  if (entry.timeouts < settings_.silent_after) return;
  const int doublings = std::min(entry.timeouts - settings_.silent_after, 30);
  const MonoNs pause = settings_.pause_first << doublings;
  const MonoNs cost = now + settings_.pacing.after_reply - event.sent.first + HeldBack(entry, now);
  entry.soon_until = now + std::min(pause, settings_.pause_max);
  entry.paused_until =
      answering_ == 0 ? entry.soon_until
                      : now + std::max(std::min(pause, settings_.pause_max_shared), settings_.pause_costs * cost);
  entry.slots.Excuse(PausedUntil(entry));
}

// Returns how long the other devices wait, because the missing reply could be confused with theirs.
MonoNs Schedule::HeldBack(const Entry& silent, MonoNs now) const {
  MonoNs longest = 0;
  for (const Entry& other : entries_) {
    if (&other == &silent || pending_ == nullptr) continue;
    const Step step = other.device->Next({.now = now, .poll_due = true, .pending = pending_});
    const auto* exchange = std::get_if<Exchange>(&step.action);
    if (exchange != nullptr) longest = std::max(longest, pending_->FreeAt(*exchange, now) - now);
  }
  return longest;
}

// The first answer after a silence of all devices: the bus works again, and every device is polled at once.
void Schedule::OnAnswered(Entry& entry) {
  if (answering_ == 0) {
    for (Entry& other : entries_) other.paused_until = 0;
  }
  if (entry.timeouts >= FailuresOfTheMissing()) ++answering_;
  entry.timeouts = 0;
  entry.paused_until = 0;
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
