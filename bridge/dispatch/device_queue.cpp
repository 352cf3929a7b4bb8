#include "bridge/dispatch/device_queue.h"

#include <algorithm>
#include <axlecast/driver_order_t.hpp>
#include <utility>

#include "core/base/text.h"
#include "core/command/command_id.h"
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

// Returns true if the task continues only after the journal has written its entry.
bool WaitsForJournal(const PendingCommand& task) {
  return task.journal_state == JournalState::kAccepted || task.journal_state == JournalState::kRouted;
}

bool IsSameProgress(const driver_status_t& driver, const command_status_t& reported) {
  return driver.state == reported.state && driver.progress == reported.progress && driver.text == reported.text;
}

}  // namespace

bool DeviceQueue::Holds(PendingCommand::Purpose purpose) const {
  const auto is = [&](const PendingCommand& task) { return task.purpose == purpose; };
  return (current_ && is(*current_)) || std::any_of(waiting_.begin(), waiting_.end(), is);
}

std::optional<std::string> DeviceQueue::SenderOf(const CommandId& id) const {
  if (current_ && current_->id == id) return current_->who;
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [&](const PendingCommand& task) { return task.id == id; });
  return found == waiting_.end() ? std::nullopt : std::optional(found->who);
}

void DeviceQueue::PushRecovered(PendingCommand task) {
  task.recovered = true;
  PushFirst(std::move(task));
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
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [&](const PendingCommand& task) { return task.id == id; });
  if (found == waiting_.end()) return false;
  PendingCommand task = std::move(*found);
  waiting_.erase(found);
  End(std::move(task), S::STATE_CANCELLED, S::REASON_CANCELLED, "cancelled while it waited for its turn", now);
  return true;
}

void DeviceQueue::OnStatus(const driver_status_t& status, Timestamp now) {
  if (!current_) return;
  PendingCommand& task = *current_;
  const CommandId id = IdOf(status.id);
  if (id != (task.queries_driver ? task.about : task.id) || status.boot_id != task.status.driver_boot_id) return;
  if (status.seq <= task.last_seq) return;  // overtaken by a newer one
  task.last_seq = status.seq;
  task.last_status = now.mono;
  if (status.state == S::STATE_UNKNOWN) return OnUnknown(status, now);
  if (status.state != S::STATE_ROUTED && status.state != S::STATE_RUNNING && !IsFinalState(status.state)) return;

  const bool same = task.acknowledged && IsSameProgress(status, task.status);
  if (!task.acknowledged) task.next_send = now.mono + kAsk;
  task.acknowledged = true;
  Copy(status, task.status);
  task.nv_writes = status.nv_writes;
  if (!IsFinalState(status.state)) {
    if (!same) output_.OnStep(task, now);
    return;
  }
  output_.OnEnd(TakeCurrent(), now);
}

// The driver's promise: no order up to its bridge_epoch has been or will be done under this id.
void DeviceQueue::OnUnknown(const driver_status_t& status, Timestamp now) {
  PendingCommand& task = *current_;
  if (status.bridge_epoch < (task.queries_driver ? task.about_epoch : task.sent_epoch)) return;
  if (task.queries_driver) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DRIVER_SILENT, "the driver never received it", now);
  }
  if (task.recovered) {
    return End(TakeCurrent(), S::STATE_REJECTED, S::REASON_BRIDGE_RESTARTED,
               "the bridge restarted before the driver had it: nothing was done; send it again", now);
  }
  if (now.mono >= task.begin_by) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DEADLINE, "its time ran out before it reached the driver",
               now);
  }
  task.acknowledged = false;
  task.next_send = now.mono;
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

void DeviceQueue::DropWaiting(Timestamp now) {
  if (waiting_.empty()) return;
  std::deque<PendingCommand> kept;
  std::deque<PendingCommand> expired;
  std::deque<PendingCommand> absent;
  std::deque<std::pair<PendingCommand, Error>> not_journalled;
  for (PendingCommand& task : waiting_) {
    Result<> in_time = WaitsForJournal(task) ? output_.CheckJournalWait(task, now) : Result<>();
    if (WaitsForJournal(task) && task.operation->urgent && now.mono - task.journal_since > kOvertaken) {
      task.journal_state =
          task.journal_state == JournalState::kAccepted ? JournalState::kNone : JournalState::kReady;
      in_time = {};
    }
    const bool needs_driver = task.purpose != PendingCommand::Purpose::kOutcomeCheck && !task.recovered;
    if (now.mono >= task.begin_by) {
      expired.push_back(std::move(task));
    } else if (needs_driver && driver_.IsAbsent(now.mono)) {
      absent.push_back(std::move(task));
    } else if (!in_time) {
      not_journalled.emplace_back(std::move(task), std::move(in_time.error()));
    } else {
      kept.push_back(std::move(task));
    }
  }
  waiting_ = std::move(kept);
  for (auto& [task, refusal] : not_journalled) {
    End(std::move(task), S::STATE_REJECTED, refusal.reason, refusal.text, now);
  }
  for (PendingCommand& task : expired) {
    End(std::move(task), S::STATE_EXPIRED, S::REASON_DEADLINE, "its time ran out while it waited for its turn",
        now);
  }
  for (PendingCommand& task : absent) {
    End(std::move(task), S::STATE_REJECTED, S::REASON_DRIVER_ABSENT,
        "the device's driver has gone: start it (axlecast driver, systemctl), then send this again", now);
  }
}

void DeviceQueue::PushFirst(PendingCommand task) {
  task.journal_state = JournalState::kNone;
  waiting_.push_front(std::move(task));
}

PendingCommand DeviceQueue::Take(std::deque<PendingCommand>::iterator task) {
  PendingCommand taken = std::move(*task);
  waiting_.erase(task);
  return taken;
}

bool DeviceQueue::IsAwaitingAcceptance(const CommandId& id) const {
  return std::any_of(waiting_.begin(), waiting_.end(), [&](const PendingCommand& task) {
    return task.id == id && task.journal_state == JournalState::kAccepted;
  });
}

std::optional<PendingCommand> DeviceQueue::Withdraw(const CommandId& id) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const PendingCommand& task) {
    return task.id == id && task.journal_state == JournalState::kAccepted;
  });
  return found == waiting_.end() ? std::nullopt : std::optional(Take(found));
}

void DeviceQueue::OnJournalled(const CommandId& id, JournalState what, bool written, const Error& not_written,
                               Timestamp now) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const PendingCommand& task) {
    return task.id == id && task.journal_state == what;
  });
  if (found == waiting_.end()) return;
  if (!written && !found->operation->urgent) {
    return End(Take(found), S::STATE_REJECTED, not_written.reason, not_written.text, now);
  }
  found->journal_state = what == JournalState::kAccepted ? JournalState::kNone : JournalState::kReady;
}

// The task whose turn it is: the first, or, while that waits for a slow journal, the first read behind it.
std::deque<PendingCommand>::iterator DeviceQueue::Next(Timestamp now) {
  const auto first = waiting_.begin();
  if (!WaitsForJournal(*first) || now.mono - first->journal_since <= kOvertaken) return first;
  return std::find_if(first, waiting_.end(), [](const PendingCommand& task) {
    return !WaitsForJournal(task) && (task.prepare || (task.operation != nullptr && task.operation->reads_only));
  });
}

void DeviceQueue::RouteNext(Timestamp now) {
  const auto next = Next(now);
  if (next == waiting_.end() || next->journal_state == JournalState::kAccepted) return;
  PendingCommand& task = *next;
  if (task.recovered) {
    current_ = Take(next);
    current_->acknowledged = true;
    current_->last_status = current_->routed = current_->next_send = now.mono;
    return Follow(now);
  }
  if (!driver_.IsPresent(now.mono) || now.mono < task.not_before) return;
  if (task.purpose == PendingCommand::Purpose::kOutcomeCheck) {
    task.queries_driver = task.about_silent && driver_.boot_id() == task.about_boot_id;
    if (!task.queries_driver && task.operation == nullptr) {
      return End(Take(next), S::STATE_FAILED, S::REASON_NONE, "no operation can verify it", now);
    }
    if (!task.queries_driver && !driver_.IsAnswering(task.device)) return;
  }
  if (task.journal_state == JournalState::kNone) {
    if (task.purpose != PendingCommand::Purpose::kCommand) task.id = output_.NewId();
    task.status.state = S::STATE_ROUTED;
    task.status.driver_boot_id = driver_.boot_id();
    task.journal_since = now.mono;
    if (const Result<> routable = output_.BeforeRoute(task, now); !routable) {
      return End(Take(next), S::STATE_REJECTED, routable.error().reason, routable.error().text, now);
    }
  }
  if (task.status.driver_boot_id != driver_.boot_id()) {
    return End(Take(next), S::STATE_REJECTED, S::REASON_DRIVER_RESTARTED,
               "the driver restarted before this was sent to it: nothing was done; send it again", now);
  }
  if (task.journal_state == JournalState::kReady) Route(Take(next), now);
}

void DeviceQueue::Route(PendingCommand task, Timestamp now) {
  current_ = std::move(task);
  current_->acknowledged = false;
  current_->last_seq = -1;
  current_->last_status = current_->routed = current_->next_send = now.mono;
  SendDue(*current_, now);
  output_.OnStep(*current_, now);
}

void DeviceQueue::Follow(Timestamp now) {
  PendingCommand& task = *current_;
  const bool unheard = task.recovered && driver_.boot_id() == 0;
  if (!unheard && driver_.boot_id() != task.status.driver_boot_id) {
    return OnDriverLost(S::REASON_DRIVER_RESTARTED, "the driver restarted while it had this order", now);
  }
  if (!unheard && !driver_.IsRunning()) {
    return OnDriverLost(S::REASON_STOPPING, "the driver stopped while it had this order", now);
  }
  if (now.mono - task.last_status > kSilentAfter) {
    return OnDriverLost(S::REASON_DRIVER_SILENT, "the driver has not answered for 5 s", now);
  }
  if (task.purpose == PendingCommand::Purpose::kOutcomeCheck && now.mono >= task.begin_by) {
    return End(TakeCurrent(), S::STATE_EXPIRED, S::REASON_DEADLINE, "the driver did not report in time", now);
  }
  SendDue(task, now);
}

void DeviceQueue::SendDue(PendingCommand& task, Timestamp now) {
  if (now.mono < task.next_send) return;
  const bool first_second = now.mono - task.routed < kSecond;
  task.next_send = now.mono + (task.acknowledged && !task.cancel_asked ? kAsk
                               : first_second                          ? kRepeat
                                                                       : kSlowRepeat);
  if (task.cancel_asked) {
    output_.Send(task, driver_order_t::KIND_CANCEL, 1, now);
  } else if (task.acknowledged || task.queries_driver || now.mono >= task.begin_by) {
    output_.Send(task, driver_order_t::KIND_QUERY, 1, now);
  } else {
    const MonoNs left = std::min<MonoNs>(task.begin_by - now.mono, 3'600 * kSecond);
    const auto valid_ms = static_cast<std::int32_t>(std::max<MonoNs>(left / kMillisecond, 1));
    task.sent_epoch = output_.Send(task, task.prepare ? driver_order_t::KIND_PREPARE : driver_order_t::KIND_EXECUTE,
                                   valid_ms, now);
  }
}

void DeviceQueue::OnDriverLost(std::int32_t reason, const std::string& text, Timestamp now) {
  PendingCommand task = TakeCurrent();
  if (task.purpose == PendingCommand::Purpose::kOutcomeCheck)
    return PushFirst(std::move(task));  // until its time runs out
  if (task.prepare || (task.operation != nullptr && task.operation->reads_only)) {
    return End(std::move(task), S::STATE_REJECTED, reason, text + "; it would have changed nothing: repeat it",
               now);
  }
  End(std::move(task), S::STATE_INDETERMINATE, reason, text, now);
}

void DeviceQueue::End(PendingCommand task, std::int8_t state, std::int32_t reason, const std::string& text,
                      Timestamp now) {
  task.status.state = state;
  task.status.reason_code = reason;
  task.status.text = CappedText(text, kTextBytes);
  task.status.finished_utime = now.utime;
  output_.OnEnd(std::move(task), now);
}

PendingCommand DeviceQueue::TakeCurrent() {
  PendingCommand task = std::move(*current_);
  current_.reset();
  return task;
}

}  // namespace axlecast
