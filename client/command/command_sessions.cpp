#include "client/command/command_sessions.h"

#include <algorithm>
#include <axlecast/command_t.hpp>

#include "core/messages/message.h"

namespace axlecast {

CommandSessions::CommandSessions(const Clock& clock, MessageSink& sink, std::int64_t boot_id, ClientKeys keys)
    : clock_(clock), sink_(sink), boot_id_(boot_id), keys_(std::move(keys)) {}

void CommandSessions::Send(const CommandId& id, const CommandRequest& request) {
  const std::string problem = FormProblem(request);
  if (!problem.empty()) {
    Insert({Kind::kCommand, id}, CommandSession::Refused(id, problem + ": nothing was sent", false));
  } else if (open_.size() >= kMaxOpen) {
    Insert(
        {Kind::kCommand, id},
        CommandSession::Refused(id, "too many commands are under way: nothing was sent; await some first", true));
  } else {
    Insert({Kind::kCommand, id}, CommandSession(id, request, keys_, clock_.Now()));
  }
}

void CommandSessions::Refuse(const CommandId& id, const std::string& problem) {
  Insert({Kind::kCommand, id}, CommandSession::Refused(id, problem, true));
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

void CommandSessions::OnStatus(Bytes message, const std::function<void(const command_status_t&)>& tell) {
  const auto status = DecodeMessage<command_status_t>(message);
  if (!status) return;
  const MonoNs now = clock_.Now();
  for (auto& [key, session] : open_) {
    if (session.OnStatus(*status, now) && key.first == Kind::kCommand && tell) tell(*status);
  }
}

MonoNs CommandSessions::Poll() {
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
  envelope.boot_id = boot_id_;
  envelope.seq = seq_++;
  envelope.body = body.bytes;
  envelope.body_size = static_cast<std::int16_t>(body.bytes.size());
  std::copy(body.signature.begin(), body.signature.end(), std::begin(envelope.sig));
  axlecast::Publish(sink_, "COMMAND", envelope);
}

}  // namespace axlecast
