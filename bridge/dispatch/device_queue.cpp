#include "bridge/dispatch/device_queue.h"

#include <algorithm>
#include <axlecast/driver_order_t.hpp>
#include <utility>
#include <vector>

#include "core/base/text.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using S = command_status_t;

void Copy(const driver_status_t& from, command_status_t& to) {
  to.state = from.state;
  to.verified = from.verified;
  to.progress = from.progress;
  to.reason_code = from.reason_code;
  to.text = CappedText(from.text, kTextBytes);
  to.started_utime = from.started_utime;
  to.finished_utime = from.finished_utime;
  to.epoch_after = from.epoch_after;
  to.changes.clear();
  for (const change_t& change : from.changes) {
    if (to.changes.size() == kMaxChanges) break;
    to.changes.push_back({CappedText(change.key, kNameBytes), CappedText(change.before, kChangeBytes),
                          CappedText(change.after, kChangeBytes)});
  }
  to.n_changes = static_cast<std::int8_t>(to.changes.size());
}

using JournalState = PendingCommand::JournalState;

// Returns true if the command continues only after the journal has written its entry.
bool WaitsForJournal(const PendingCommand& pending) {
  return pending.journal_state == JournalState::kAccepted || pending.journal_state == JournalState::kRouted;
}

bool IsSameProgress(const driver_status_t& driver, const command_status_t& reported) {
  return driver.state == reported.state && driver.progress == reported.progress && driver.text == reported.text;
}

}  // namespace

bool DeviceQueue::Holds(PendingCommand::Purpose purpose) const {
  const auto is = [&](const PendingCommand& pending) { return pending.purpose == purpose; };
  return (current_ && is(*current_)) || std::any_of(waiting_.begin(), waiting_.end(), is);
}

// Returns the waiting command of this id; if `state` is given, only in this state.
DeviceQueue::Place DeviceQueue::Waiting(const CommandId& id, std::optional<JournalState> state) {
  return std::find_if(waiting_.begin(), waiting_.end(), [&](const PendingCommand& pending) {
    return pending.id == id && (!state || pending.journal_state == *state);
  });
}

std::optional<std::string> DeviceQueue::SenderOf(const CommandId& id) {
  if (current_ && current_->id == id) return current_->who;
  const auto found = Waiting(id);
  return found == waiting_.end() ? std::nullopt : std::optional(found->who);
}

void DeviceQueue::PushRecovered(PendingCommand pending) {
  pending.recovered = true;
  PushFirst(std::move(pending));
}

bool DeviceQueue::Cancel(const CommandId& id, Timestamp now) {
  if (current_ && current_->id == id && current_->purpose == PendingCommand::Purpose::kCommand) {
    if (!current_->cancel_asked) {
      current_->cancel_asked = true;
      current_->next_send = now.mono;
      SendDue(*current_, now);
    }
    return true;
  }
  const auto found = Waiting(id);
  if (found == waiting_.end()) return false;
  if (found->recovered) {  // its driver may have executed it
    found->cancel_asked = true;
    return true;
  }
  End(Take(found), S::STATE_CANCELLED, S::REASON_CANCELLED, "cancelled while it waited in the queue", now);
  return true;
}

void DeviceQueue::OnStatus(const driver_status_t& status, Timestamp now) {
  if (!current_) return;
  PendingCommand& pending = *current_;
  const CommandId id = IdOf(status.id);
  if (id != (pending.queries_driver ? pending.about : pending.id) ||
      status.boot_id != pending.status.driver_boot_id)
    return;
  if (status.seq <= pending.last_seq) return;  // overtaken by a newer one
  pending.last_seq = status.seq;
  pending.last_status = now.mono;
  if (status.state == S::STATE_UNKNOWN) return OnUnknown(status, now);
  if (status.state != S::STATE_ROUTED && status.state != S::STATE_RUNNING && !IsFinalState(status.state)) return;

  const bool same = pending.acknowledged && IsSameProgress(status, pending.status);
  if (!pending.acknowledged) pending.next_send = now.mono + kAsk;
  pending.acknowledged = true;
  Copy(status, pending.status);
  pending.nv_writes = status.nv_writes;
  if (!IsFinalState(status.state)) {
    if (!same) output_.OnStep(pending, now);
    return;
  }
  output_.OnEnd(TakeCurrent(), now);
}

// The driver's promise: no order up to its bridge_epoch has been or will be done under this id.
void DeviceQueue::OnUnknown(const driver_status_t& status, Timestamp now) {
  PendingCommand& pending = *current_;
  if (status.bridge_epoch < (pending.queries_driver ? pending.about_epoch : pending.sent_epoch)) return;
  if (pending.queries_driver) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DRIVER_SILENT, "the driver never received it", now);
  }
  if (pending.recovered) {
    return End(TakeCurrent(), S::STATE_REJECTED, S::REASON_BRIDGE_RESTARTED,
               "the bridge restarted before the driver had it: nothing was done; send it again", now);
  }
  if (now.mono >= pending.begin_by) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DEADLINE, "its time ran out before it reached the driver",
               now);
  }
  pending.acknowledged = false;
  pending.next_send = now.mono;
}

void DeviceQueue::Tick(Timestamp now) {
  DropWaiting(now);
  if (current_) Follow(now);
  // What ends at once (nothing can find it) makes room for the next.
  while (!current_ && !waiting_.empty()) {
    const std::size_t before = waiting_.size();
    RouteNext(now);
    if (!current_ && waiting_.size() >= before) break;
  }
}

// Ends the waiting commands that can no longer be sent.
void DeviceQueue::DropWaiting(Timestamp now) {
  struct Ended {
    PendingCommand command;
    std::int8_t state;
    Error why;
  };
  std::deque<PendingCommand> kept;
  std::vector<Ended> ended;
  for (PendingCommand& pending : waiting_) {
    Result<> in_time = WaitsForJournal(pending) ? output_.CheckJournalWait(pending, now) : Result<>();
    if (WaitsForJournal(pending) && pending.operation->urgent && now.mono - pending.journal_since > kOvertaken) {
      pending.journal_state =
          pending.journal_state == JournalState::kAccepted ? JournalState::kNone : JournalState::kReady;
      in_time = {};
    }
    const bool needs_driver = pending.purpose != PendingCommand::Purpose::kOutcomeCheck && !pending.recovered;
    if (now.mono >= pending.begin_by) {
      ended.push_back({std::move(pending),
                       S::STATE_EXPIRED,
                       {"its time ran out while it waited in the queue", S::REASON_DEADLINE}});
    } else if (needs_driver && driver_.IsAbsent(now.mono)) {
      ended.push_back({std::move(pending),
                       S::STATE_REJECTED,
                       {"the device's driver has gone: start it (axlecast driver, systemctl), then send this again",
                        S::REASON_DRIVER_ABSENT}});
    } else if (!in_time) {
      ended.push_back({std::move(pending), S::STATE_REJECTED, std::move(in_time.error())});
    } else {
      kept.push_back(std::move(pending));
    }
  }
  waiting_ = std::move(kept);
  for (Ended& one : ended) End(std::move(one.command), one.state, one.why.reason, one.why.text, now);
}

void DeviceQueue::PushFirst(PendingCommand pending) {
  pending.journal_state = JournalState::kNone;
  waiting_.push_front(std::move(pending));
}

PendingCommand DeviceQueue::Take(Place pending) {
  PendingCommand taken = std::move(*pending);
  waiting_.erase(pending);
  return taken;
}

bool DeviceQueue::IsAwaitingAcceptance(const CommandId& id) {
  return Waiting(id, JournalState::kAccepted) != waiting_.end();
}

std::optional<PendingCommand> DeviceQueue::Withdraw(const CommandId& id) {
  const auto found = Waiting(id, JournalState::kAccepted);
  return found == waiting_.end() ? std::nullopt : std::optional(Take(found));
}

void DeviceQueue::OnJournalled(const CommandId& id, JournalState what, bool written, const Error& not_written,
                               Timestamp now) {
  const auto found = Waiting(id, what);
  if (found == waiting_.end()) return;
  if (!written && !found->operation->urgent) {
    return End(Take(found), S::STATE_REJECTED, not_written.reason, not_written.text, now);
  }
  found->journal_state = what == JournalState::kAccepted ? JournalState::kNone : JournalState::kReady;
}

// The next command: the first, or, while that waits for a slow journal, the first read behind it.
DeviceQueue::Place DeviceQueue::Next(Timestamp now) {
  const auto first = waiting_.begin();
  if (!WaitsForJournal(*first) || now.mono - first->journal_since <= kOvertaken) return first;
  return std::find_if(first, waiting_.end(), [](const PendingCommand& pending) {
    return !WaitsForJournal(pending) &&
           (pending.prepare || (pending.operation != nullptr && pending.operation->reads_only));
  });
}

void DeviceQueue::RouteNext(Timestamp now) {
  const auto next = Next(now);
  if (next == waiting_.end() || next->journal_state == JournalState::kAccepted) return;
  PendingCommand& pending = *next;
  if (pending.recovered) {
    current_ = Take(next);
    current_->acknowledged = true;
    current_->last_status = current_->routed = current_->next_send = now.mono;
    return Follow(now);
  }
  if (!driver_.IsPresent(now.mono) || now.mono < pending.not_before) return;
  if (pending.purpose == PendingCommand::Purpose::kOutcomeCheck) {
    pending.queries_driver = pending.about_silent && driver_.boot_id() == pending.about_boot_id;
    if (!pending.queries_driver && pending.operation == nullptr) {
      return End(Take(next), S::STATE_FAILED, S::REASON_NONE, "no operation can verify it", now);
    }
    if (!pending.queries_driver && !driver_.IsAnswering(pending.device)) return;
  }
  if (pending.journal_state == JournalState::kNone) {
    if (pending.purpose != PendingCommand::Purpose::kCommand) pending.id = output_.NewId();
    pending.status.state = S::STATE_ROUTED;
    pending.status.driver_boot_id = driver_.boot_id();
    pending.journal_since = now.mono;
    if (const Result<> routable = output_.BeforeRoute(pending, now); !routable) {
      return End(Take(next), S::STATE_REJECTED, routable.error().reason, routable.error().text, now);
    }
  }
  if (pending.status.driver_boot_id != driver_.boot_id()) {
    return End(Take(next), S::STATE_REJECTED, S::REASON_DRIVER_RESTARTED,
               "the driver restarted before this was sent to it: nothing was done; send it again", now);
  }
  if (pending.journal_state == JournalState::kReady) Route(Take(next), now);
}

void DeviceQueue::Route(PendingCommand pending, Timestamp now) {
  current_ = std::move(pending);
  current_->acknowledged = false;
  current_->last_seq = -1;
  current_->last_status = current_->routed = current_->next_send = now.mono;
  SendDue(*current_, now);
  output_.OnStep(*current_, now);
}

void DeviceQueue::Follow(Timestamp now) {
  PendingCommand& pending = *current_;
  const bool unheard = pending.recovered && driver_.boot_id() == 0;
  if (!unheard && driver_.boot_id() != pending.status.driver_boot_id) {
    return OnDriverLost(S::REASON_DRIVER_RESTARTED, "the driver restarted while it had this order", now);
  }
  if (!unheard && !driver_.IsRunning()) {
    return OnDriverLost(S::REASON_STOPPING, "the driver stopped while it had this order", now);
  }
  if (now.mono - pending.last_status > kSilentAfter) {
    return OnDriverLost(S::REASON_DRIVER_SILENT, "the driver has not answered for 5 s", now);
  }
  if (pending.purpose == PendingCommand::Purpose::kOutcomeCheck && now.mono >= pending.begin_by) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DEADLINE, "the driver did not report in time", now);
  }
  SendDue(pending, now);
}

void DeviceQueue::SendDue(PendingCommand& pending, Timestamp now) {
  if (now.mono < pending.next_send) return;
  const bool first_second = now.mono - pending.routed < kSecond;
  pending.next_send = now.mono + (pending.acknowledged && !pending.cancel_asked ? kAsk
                                  : first_second                                ? kRepeat
                                                                                : kSlowRepeat);
  if (pending.cancel_asked) {
    output_.Send(pending, driver_order_t::KIND_CANCEL, 1, now);
  } else if (pending.acknowledged || pending.queries_driver || now.mono >= pending.begin_by) {
    output_.Send(pending, driver_order_t::KIND_QUERY, 1, now);
  } else {
    const MonoNs left = std::min<MonoNs>(pending.begin_by - now.mono, 3'600 * kSecond);
    const auto valid_ms = static_cast<std::int32_t>(std::max<MonoNs>(left / kMillisecond, 1));
    pending.sent_epoch = output_.Send(
        pending, pending.prepare ? driver_order_t::KIND_PREPARE : driver_order_t::KIND_EXECUTE, valid_ms, now);
  }
}

void DeviceQueue::OnDriverLost(std::int32_t reason, const std::string& text, Timestamp now) {
  PendingCommand pending = TakeCurrent();
  if (pending.purpose == PendingCommand::Purpose::kOutcomeCheck)
    return PushFirst(std::move(pending));  // until its time runs out
  if (pending.prepare || (pending.operation != nullptr && pending.operation->reads_only)) {
    return End(std::move(pending), S::STATE_REJECTED, reason, text + "; it would have changed nothing: repeat it",
               now);
  }
  End(std::move(pending), S::STATE_INDETERMINATE, reason, text, now);
}

void DeviceQueue::End(PendingCommand pending, std::int8_t state, std::int32_t reason, const std::string& text,
                      Timestamp now) {
  pending.status.state = state;
  pending.status.reason_code = reason;
  pending.status.text = CappedText(text, kTextBytes);
  pending.status.finished_utime = now.utime;
  output_.OnEnd(std::move(pending), now);
}

PendingCommand DeviceQueue::TakeCurrent() {
  PendingCommand pending = std::move(*current_);
  current_.reset();
  return pending;
}

}  // namespace axlecast
