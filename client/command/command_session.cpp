#include "client/command/command_session.h"

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>

#include "core/base/result.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr const char* kUnauthorizedStatuses =
    "statuses come, but their signature does not fit the bridge key of the machine's file";

bool HasSameContent(const S& one, const S& other) {
  return one.state == other.state && one.finding == other.finding && one.progress == other.progress &&
         one.text == other.text;
}

// Handles the answer of a bridge that cannot read its journal: it contains the boot id, but no status of the command.
bool HasNoStatus(const S& status) {
  return status.state == S::STATE_UNKNOWN && status.reason_code == S::REASON_JOURNAL;
}

// A boot of the bridge for which the command was not meant.
bool IsStale(const S& status) {
  return status.state == S::STATE_REJECTED && status.reason_code == S::REASON_STALE_BRIDGE;
}

}  // namespace

CommandSession::CommandSession(const CommandId& id, const ClientKeys& keys, MonoNs now)
    : keys_(keys), received_(now), other_received_(now), next_send_(now) {
  result_.id = id;
}

CommandSession::CommandSession(const CommandId& id, CommandRequest request, const ClientKeys& keys, MonoNs now)
    : CommandSession(id, keys, now) {
  request_ = std::move(request);
  result_.prepare = request_.prepare;
  result_.status.device = request_.device;
  result_.status.operation = request_.operation;
}

CommandSession CommandSession::Query(const CommandId& id, const CommandId& probe, const ClientKeys& keys,
                                     MonoNs now) {
  CommandSession session(id, keys, now);
  session.only_query_ = true;
  session.probe_ = probe;
  session.probing_ = keys.bridge.has_value();
  return session;
}

CommandSession CommandSession::Refused(const CommandId& id, const CommandRequest& request,
                                       const std::string& problem, bool can_resend) {
  CommandSession session(id, request, ClientKeys{}, 0);
  session.EndNotAccepted(problem);
  session.result_.can_resend = can_resend;
  return session;
}

void CommandSession::Cancel(MonoNs now) {
  if (cancelling_ || only_query_ || done_) return;
  cancelling_ = true;
  next_send_ = now;
  if (phase_ != Phase::kLearning) return;
  result_.answered = true;
  result_.status.state = S::STATE_CANCELLED;
  result_.status.is_final = 1;
  result_.status.reason_code = S::REASON_CANCELLED;
  result_.status.text = "cancelled before it was sent";
  done_ = true;
}

void CommandSession::EndWithoutPort(const std::string& problem) {
  if (done_) return;
  if (result_.status.is_final != 0) {
    done_ = true;  // an INDETERMINATE whose finding cannot come any more
  } else if (phase_ == Phase::kLearning) {
    EndNotAccepted(problem + ": nothing was sent");
  } else {
    End(problem + ": ask for this id later");
  }
}

std::int8_t CommandSession::Mode() const {
  if (request_.prepare) return command_body_t::MODE_PREPARE;
  return request_.token ? command_body_t::MODE_COMMIT : command_body_t::MODE_EXECUTE;
}

std::optional<SignedBody> CommandSession::Next(MonoNs now) {
  EndWhenHopeless(now);
  if (done_ || now < next_send_) return std::nullopt;
  next_send_ = now + (phase_ == Phase::kFollowing && !cancelling_ ? kAsk : kRepeat);
  if (phase_ == Phase::kSending) {
    main_sent_ = now;
    return main_;
  }
  if (phase_ == Phase::kFollowing && cancelling_) {
    const BridgeTimestamp bridge{bridge_boot_id_, bridge_mono_ + (now - received_)};
    return MakeBody(result_.id, request_, command_body_t::MODE_CANCEL, bridge, keys_);
  }
  return QueryBody(probing_ ? probe_ : result_.id);
}

MonoNs CommandSession::NextAt() const { return done_ ? kNever : std::min(next_send_, HopelessAt()); }

bool CommandSession::OnStatus(const command_status_t& status, MonoNs now) {
  if (done_ || IdOf(status.id) != (probing_ ? probe_ : result_.id)) return false;
  if (keys_.bridge && !VerifyMessage(*keys_.bridge, Domain::kStatus, status)) {
    ++unauthorized_;
    return false;
  }
  if (only_query_) return OnQueried(status, now);
  if (phase_ == Phase::kLearning) {
    Learn(status, now);
    return false;
  }
  if (HasNoStatus(status)) return false;
  if (status.boot_id != bridge_boot_id_) return OnOtherBoot(status, now);
  Received(status, now);
  if (status.body_digest == digest_) return Follow(status, now);
  // The old boot lives after all: it was the other one that did not belong here.
  if (phase_ == Phase::kAsking) phase_ = result_.answered ? Phase::kFollowing : Phase::kSending;
  return false;
}

void CommandSession::Received(const command_status_t& status, MonoNs now) {
  received_ = now;
  bridge_mono_ = status.mono_ns;
}

bool CommandSession::OnQueried(const command_status_t& status, MonoNs now) {
  if (probing_) {
    probing_ = false;
    bridge_boot_id_ = status.boot_id;
    Received(status, now);
    next_send_ = now;
    return false;
  }
  if (keys_.bridge && (status.boot_id != bridge_boot_id_ || status.mono_ns < bridge_mono_)) return false;
  if (HasNoStatus(status)) return false;
  if (status.state == S::STATE_UNKNOWN) {
    End("the bridge does not know this id: it never accepted such a command, or no longer keeps it");
    return true;
  }
  result_.status = status;
  result_.answered = true;
  done_ = true;
  if (status.is_final == 0) End("it is " + std::string(StateName(status.state)) + " still: ask for it later");
  return true;
}

void CommandSession::Learn(const command_status_t& status, MonoNs now) {
  bridge_boot_id_ = status.boot_id;
  Received(status, now);
  main_ = MakeBody(result_.id, request_, Mode(), {bridge_boot_id_, bridge_mono_}, keys_);
  digest_ = BodyDigest(main_.bytes);
  phase_ = Phase::kSending;
  next_send_ = now;
}

bool CommandSession::OnOtherBoot(const command_status_t& status, MonoNs now) {
  if (std::find(former_boots_.begin(), former_boots_.end(), status.boot_id) != former_boots_.end()) return false;
  other_received_ = now;
  if (status.body_digest == digest_ && !IsStale(status)) {  // it has our journal
    former_boots_.push_back(bridge_boot_id_);
    bridge_boot_id_ = status.boot_id;
    bridge_seq_ = -1;
    Received(status, now);
    return Follow(status, now);
  }
  // Two bridges may be there, and what was sent to the old one may be on its way.
  if (phase_ == Phase::kAsking && now - std::max(received_, main_sent_) >= kSettled) {
    EndNotTakenOver();
    return false;
  }
  if (phase_ != Phase::kAsking) next_send_ = now;
  phase_ = Phase::kAsking;
  return false;
}

void CommandSession::EndNotTakenOver() {
  if (result_.status.is_final != 0) {
    done_ = true;  // an INDETERMINATE; nobody makes its finding any more
  } else if (result_.answered) {
    End("the bridge restarted and its journal does not hold this command any more: look at the device before you "
        "send it again");
  } else {
    EndNotAccepted("the bridge restarted and never accepted it: nothing was done; send it again");
  }
}

// An outcome is final, and a status that was sent before the newest one is late.
bool CommandSession::IsLate(const command_status_t& status) const {
  if (status.seq < bridge_seq_) return true;
  return result_.status.is_final != 0 && (status.is_final == 0 || status.finding == S::FINDING_NONE);
}

bool CommandSession::Follow(const command_status_t& status, MonoNs now) {
  if (IsLate(status)) return false;
  bridge_seq_ = status.seq;
  const bool news = !result_.answered || !HasSameContent(status, result_.status);
  if (!cancelling_ || phase_ != Phase::kFollowing) next_send_ = now + (cancelling_ ? 0 : kAsk);
  phase_ = Phase::kFollowing;
  result_.answered = true;
  result_.status = status;
  if (status.is_final != 0) final_at_ = now;
  done_ = IsComplete(status);
  return news;
}

MonoNs CommandSession::HopelessAt() const {
  const MonoNs silence =
      std::max(received_, other_received_) + (phase_ == Phase::kLearning ? kNoBridge : kBridgeSilence) + 1;
  return result_.status.is_final != 0 ? std::min(silence, final_at_ + kFindingWait) : silence;
}

void CommandSession::EndWhenHopeless(MonoNs now) {
  if (done_ || now < HopelessAt()) return;
  if (result_.status.is_final != 0) {
    done_ = true;  // an INDETERMINATE whose finding did not come
  } else if (phase_ != Phase::kLearning) {
    End(std::string(unauthorized_ > 0 ? kUnauthorizedStatuses : "the bridge fell silent") +
        ": ask for this id later, and look at the device");
  } else if (unauthorized_ > 0) {
    std::string text(kUnauthorizedStatuses);
    text.append(" (bridge: key: public): put the running bridge's public key there; nothing was sent");
    EndNotAccepted(text);
  } else {
    EndNotAccepted(
        "no bridge answers on the command port: start axlecast-bridge (or axlecast up); nothing was sent");
  }
}

void CommandSession::End(std::string_view problem) {
  result_.problem = problem;
  done_ = true;
}

// A query does not show whether a command was accepted.
void CommandSession::EndNotAccepted(std::string_view problem) {
  result_.not_accepted = !only_query_;
  result_.can_resend = !only_query_;
  End(problem);
}

CommandSessions::CommandSessions(const Clock& clock, MessageSink& sink, const Origin& origin, ClientKeys keys)
    : clock_(clock), sink_(sink), origin_(origin), keys_(std::move(keys)) {}

void CommandSessions::Send(const CommandId& id, const CommandRequest& request) {
  if (const Result<> form = CheckForm(request); !form) {
    Insert({Kind::kCommand, id},
           CommandSession::Refused(id, request, form.error().text + ": nothing was sent", false));
  } else if (open_.size() >= kMaxOpen) {
    Insert({Kind::kCommand, id},
           CommandSession::Refused(id, request,
                                   "too many commands are under way: nothing was sent; await some first", true));
  } else {
    Insert({Kind::kCommand, id}, CommandSession(id, request, keys_, clock_.Now()));
  }
}

void CommandSessions::Refuse(const CommandId& id, const CommandRequest& request, const std::string& problem) {
  Insert({Kind::kCommand, id}, CommandSession::Refused(id, request, problem, true));
}

void CommandSessions::EndAll(const std::string& problem) {
  for (auto& [key, session] : open_) session.EndWithoutPort(problem);
}

void CommandSessions::Cancel(const CommandId& id) {
  const auto found = open_.find({Kind::kCommand, id});
  if (found != open_.end()) found->second.Cancel(clock_.Now());
}

void CommandSessions::Query(const CommandId& id, const CommandId& probe) {
  const Key key{Kind::kQuery, id};
  if (open_.count(key) == 0) Insert(key, CommandSession::Query(id, probe, keys_, clock_.Now()));
}

void CommandSessions::Insert(const Key& key, CommandSession session) {
  if (ended_.erase(key) != 0) std::erase(oldest_first_, key);
  open_.emplace(key, std::move(session));
}

void CommandSessions::OnStatus(Bytes message, const Report& report) {
  const auto status = DecodeMessage<command_status_t>(message);
  if (!status) return;
  const MonoNs now = clock_.Now();
  for (auto& [key, session] : open_) {
    if (!session.OnStatus(*status, now) || key.first != Kind::kCommand || session.done() || !report) continue;
    CommandResult result = session.result();
    result.under_way = true;
    report(result);
  }
}

MonoNs CommandSessions::Poll(const Report& report) {
  const MonoNs now = clock_.Now();
  MonoNs next = kNever;
  for (auto entry = open_.begin(); entry != open_.end();) {
    CommandSession& session = entry->second;
    if (const auto body = session.Next(now)) Publish(*body);
    next = std::min(next, session.NextAt());
    if (!session.done()) {
      ++entry;
      continue;
    }
    if (report && entry->first.first == Kind::kCommand) report(session.result());
    oldest_first_.push_back(entry->first);
    ended_.insert(open_.extract(entry++));
  }
  ForgetOldest();
  return next;
}

void CommandSessions::ForgetOldest() {
  while (oldest_first_.size() > kKept) {
    ended_.erase(oldest_first_.front());
    oldest_first_.pop_front();
  }
}

const CommandSession* CommandSessions::Find(const Key& key) const {
  for (const auto* sessions : {&open_, &ended_}) {
    const auto found = sessions->find(key);
    if (found != sessions->end()) return &found->second;
  }
  return nullptr;
}

void CommandSessions::Publish(const SignedBody& body) {
  command_t envelope{};
  envelope.utime = clock_.UtcMicroseconds();
  envelope.mono_ns = clock_.Now();
  origin_.Set(envelope);
  envelope.seq = seq_++;
  envelope.body = body.bytes;
  envelope.body_size = static_cast<std::int16_t>(body.bytes.size());
  std::copy(body.signature.begin(), body.signature.end(), std::begin(envelope.sig));
  axlecast::Publish(sink_, "COMMAND", envelope);
}

}  // namespace axlecast
