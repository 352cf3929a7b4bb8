#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/axlecast/command.h"
#include "client/command/signed_messages.h"
#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/message.h"
#include "core/messages/origin.h"

namespace axlecast {

// The client's side of one command, free of I/O. It asks for the state of its own new id (MODE_QUERY): the answer
// carries the bridge's boot id and clock. Then it repeats the command, the same bytes each time, until a status answers
// them, asks again when the bridge falls silent, and ends with the outcome, or with the reason why no outcome exists. When a
// new boot of the bridge appears, the session queries the id there and follows it; it never sends a command under a second id:
// whatever it sends, the device does it at most once.
class CommandSession {
 public:
  static constexpr MonoNs kRepeat = 50 * kMillisecond;
  static constexpr MonoNs kAsk = 500 * kMillisecond;  // without a word about an answered command
  // The session ends if no bridge sends anything for this time: before anything was sent; afterwards, when a bridge may be restarting.
  static constexpr MonoNs kNoBridge = 3 * kSecond;
  static constexpr MonoNs kBridgeSilence = 10 * kSecond;
  // STATE_UNKNOWN from a new boot is accepted if the old boot and this session have sent nothing for this time.
  static constexpr MonoNs kSettled = 500 * kMillisecond;
  static constexpr MonoNs kFindingWait = 25 * kSecond;  // for the finding after an INDETERMINATE, which takes 20 s

  // Executes, prepares or commits `request` under `id` (128 random bits).
  CommandSession(const CommandId& id, CommandRequest request, const ClientKeys& keys, MonoNs now);
  // Queries the state of the command `id`; sends nothing else. STATE_UNKNOWN ends it as "not known". Where the bridge signs,
  // it first asks for the new id `probe`: a status of `id` before that answer is a replay and is ignored.
  static CommandSession Query(const CommandId& id, const CommandId& probe, const ClientKeys& keys, MonoNs now);
  // One that has ended before it began: nothing was sent. `can_resend` as in CommandResult.
  static CommandSession Refused(const CommandId& id, const CommandRequest& request, const std::string& problem,
                                bool can_resend);

  // From now on asks for the command to be cancelled; it still ends with the command's one outcome.
  void Cancel(MonoNs now);
  // Ends it, because nothing can be sent or received any more.
  void EndWithoutPort(const std::string& problem);

  // What to send now, if anything.
  [[nodiscard]] std::optional<SignedBody> Next(MonoNs now);
  // When Next has something, or ends it, at the latest; kNever when it has ended.
  [[nodiscard]] MonoNs NextAt() const;
  // Returns true if the status is about this command and contains something new.
  bool OnStatus(const command_status_t& status, MonoNs now);

  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] const CommandResult& result() const { return result_; }
  // Statuses for this id that the bridge's key did not sign.
  [[nodiscard]] std::int64_t unauthorized() const { return unauthorized_; }

 private:
  // kAsking: a new boot of the bridge has appeared; the session queries whether it has the command.
  enum class Phase : std::uint8_t { kLearning, kSending, kFollowing, kAsking };

  CommandSession(const CommandId& id, const ClientKeys& keys, MonoNs now);

  [[nodiscard]] std::int8_t Mode() const;
  void Learn(const command_status_t& status, MonoNs now);
  bool OnQueried(const command_status_t& status, MonoNs now);
  bool OnOtherBoot(const command_status_t& status, MonoNs now);
  bool Follow(const command_status_t& status, MonoNs now);
  void Received(const command_status_t& status, MonoNs now);
  [[nodiscard]] bool IsLate(const command_status_t& status) const;
  [[nodiscard]] MonoNs HopelessAt() const;
  void EndWhenHopeless(MonoNs now);
  void EndNotTakenOver();
  void End(std::string_view problem);
  void EndNotAccepted(std::string_view problem);

  CommandRequest request_;
  ClientKeys keys_;
  CommandResult result_;
  bool only_query_ = false;
  CommandId probe_{};     // of a query
  bool probing_ = false;  // its answer has not come yet
  bool cancelling_ = false;
  bool done_ = false;
  Phase phase_ = Phase::kLearning;
  SignedBody main_;          // the command, once the bridge is known
  std::int64_t digest_ = 0;  // of main_
  std::int64_t bridge_boot_id_ = 0;
  std::vector<std::int64_t> former_boots_;  // their messages are late
  std::int64_t bridge_seq_ = -1;            // of the newest status followed
  MonoNs bridge_mono_ = 0;                  // the bridge's clock in its newest status
  MonoNs received_ = 0;                     // its arrival
  MonoNs other_received_ = 0;               // the newest of another boot
  MonoNs main_sent_ = 0;                    // last
  MonoNs final_at_ = 0;                     // an INDETERMINATE came
  MonoNs next_send_ = 0;
  std::int64_t unauthorized_ = 0;
};

// All sessions of a client: passes received messages to them and sends their messages. One thread at a time.
class CommandSessions {
 public:
  static constexpr std::size_t kMaxOpen = 4'096;  // under way at a time
  static constexpr std::size_t kKept = 4'096;     // of those that have ended; the oldest is forgotten first

  // What a command and a query about it are known by: they may be under way together.
  enum class Kind : std::uint8_t { kCommand, kQuery };
  using Key = std::pair<Kind, CommandId>;

  // Receives what became known of a command. Called once with under_way false for each command: it has ended.
  using Report = std::function<void(const CommandResult& result)>;

  // `clock` and `sink`, the command port, outlive it. `origin`: of this process.
  CommandSessions(const Clock& clock, MessageSink& sink, const Origin& origin, ClientKeys keys);

  // `id` is random and new. What cannot be sent has ended at once.
  void Send(const CommandId& id, const CommandRequest& request);
  // It has ended at once, for a reason outside of it.
  void Refuse(const CommandId& id, const CommandRequest& request, const std::string& problem);
  // Ends everything that is under way, because the port failed.
  void EndAll(const std::string& problem);
  void Cancel(const CommandId& id);
  // Joins a query for `id` that is under way. `probe` is random and new.
  void Query(const CommandId& id, const CommandId& probe);

  // Receives a message of COMMAND_STATUS. Reports each command that continues and of which the message is news. Poll reports ends.
  void OnStatus(Bytes message, const Report& report);
  // Sends what is due, and reports each command that has ended since the last call. Returns when it is to be called again, kNever
  // when nothing is under way.
  MonoNs Poll(const Report& report = {});

  // Null when it is not known (any more).
  [[nodiscard]] const CommandSession* Find(const Key& key) const;

 private:
  void Insert(const Key& key, CommandSession session);
  void Publish(const SignedBody& body);
  void ForgetOldest();

  const Clock& clock_;
  MessageSink& sink_;
  const Origin origin_;
  const ClientKeys keys_;
  std::int64_t seq_ = 0;
  std::map<Key, CommandSession> open_;
  std::map<Key, CommandSession> ended_;
  std::deque<Key> oldest_first_;  // of ended_
};

}  // namespace axlecast
