#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "client/command/command_session.h"
#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/message.h"

namespace axlecast {

// All sessions of a client: gives each what comes, sends what each wants sent. One thread at a time.
class CommandSessions {
 public:
  static constexpr std::size_t kMaxOpen = 4'096;  // under way at a time
  static constexpr std::size_t kKept = 4'096;     // of those that have ended; the oldest is forgotten first

  // What a command and a query about it are known by: they may be under way together.
  enum class Kind : std::uint8_t { kCommand, kQuery };
  using Key = std::pair<Kind, CommandId>;

  // `clock` and `sink`, the command port, outlive it. `boot_id`: of this process.
  CommandSessions(const Clock& clock, MessageSink& sink, std::int64_t boot_id, ClientKeys keys);

  // `id` is random and new. What cannot be sent has ended at once.
  void Send(const CommandId& id, const CommandRequest& request);
  // It has ended at once, for a reason outside of it.
  void Refuse(const CommandId& id, const std::string& problem);
  void Cancel(const CommandId& id);
  // Joins a query for `id` that is under way. `probe` is random and new.
  void Query(const CommandId& id, const CommandId& probe);

  // A message of COMMAND_STATUS. `tell` is called for what it says that is new.
  void OnStatus(Bytes message, const std::function<void(const command_status_t&)>& tell);
  // Sends what is due. Returns when it is to be called again, kNever when nothing is under way.
  MonoNs Poll();

  // Null when it is not known (any more).
  [[nodiscard]] const CommandSession* Find(const Key& key) const;

 private:
  void Insert(const Key& key, CommandSession session);
  void Publish(const SignedBody& body);
  void ForgetOldest();

  const Clock& clock_;
  MessageSink& sink_;
  const std::int64_t boot_id_;
  const ClientKeys keys_;
  std::int64_t seq_ = 0;
  std::map<Key, CommandSession> open_;
  std::map<Key, CommandSession> ended_;
  std::deque<Key> oldest_first_;  // of ended_
};

}  // namespace axlecast
