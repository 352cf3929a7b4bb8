#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "core/base/time.h"
#include "core/messages/broker_link.h"
#include "tools/mqtt/outbox.h"

namespace axlecast {

// The state of the connection to the broker.
struct BrokerStatus {
  bool connected = false;
  MonoNs since = 0;              // of `connected`
  std::int64_t connections = 0;  // since the start
  std::string problem;           // why it is not connected, or the last refusal of the broker; empty: no problem
};

// The retained messages of the session on the machine's topic `status`.
struct BrokerStatusMessages {
  std::string topic;
  std::string offline;                  // the last will
  std::function<std::string()> online;  // the current state
  std::function<std::string()> ended;   // after an orderly end
};

// Sends the messages of an outbox to a broker. It reconnects, keeps a limited number of unconfirmed messages, and repeats
// them after a lost connection. Time is an argument. All functions except status() must be called by one thread.
class BrokerSession {
 public:
  static constexpr std::size_t kWindow = 20;       // unconfirmed messages
  static constexpr MonoNs kAnswer = 10 * kSecond;  // maximum time for the reply to a connection request
  static constexpr MonoNs kConfirmation = 30 * kSecond;
  static constexpr MonoNs kFirstPause = kSecond / 2;  // between two attempts; doubled each time
  static constexpr MonoNs kLongestPause = 8 * kSecond;
  static constexpr MonoNs kStable = 10 * kSecond;  // a connection that lasts longer resets the pause
  static constexpr MonoNs kStatusEvery = 10 * kSecond;
  static constexpr int kMaxTries = 5;  // connections that may end at one message before it is given up

  BrokerSession(BrokerLink& link, Outbox& outbox, BrokerStatusMessages status);

  // Runs the steps that are due. Returns the time of the next call; call it earlier if the link or the outbox is readable.
  [[nodiscard]] MonoNs Step(MonoNs now);

  // Ends the session: sends the queued messages until `deadline`, then publishes `ended` and disconnects.
  void End(MonoNs deadline);
  [[nodiscard]] bool ended() const { return state_ == State::kEnded; }

  // Returns true if the session can take a message from the outbox.
  [[nodiscard]] bool WantsMore() const { return state_ == State::kConnected && HasRoom(); }

  [[nodiscard]] BrokerStatus status() const;

 private:
  enum class State : std::uint8_t { kWaiting, kConnecting, kConnected, kLeaving, kEnded };
  struct Sent {
    std::int64_t id = 0;  // in the outbox; kOwn: the session's own
    MonoNs at = 0;
  };
  static constexpr std::int64_t kOwn = -1;

  void On(const BrokerEvent& event, MonoNs now);
  void OnDown(const std::string& text, MonoNs now, bool fault = false);
  void OnRefused(const Sent& sent, const std::string& text);
  void SendOwn(std::string payload, MonoNs now);
  [[nodiscard]] bool HasRoom() const;
  void SendWaiting(MonoNs now);
  void Leave(MonoNs now);
  void CheckAnswers(MonoNs now);
  void SuspectOldest();
  [[nodiscard]] MonoNs NextStep() const;
  void SetConnected(bool connected, MonoNs now);

  BrokerLink& link_;
  Outbox& outbox_;
  BrokerStatusMessages own_;
  State state_ = State::kWaiting;
  MonoNs deadline_ = 0;  // of the pause, or of the broker's answer
  MonoNs pause_ = kFirstPause;
  MonoNs connected_at_ = 0;
  MonoNs next_status_ = 0;
  MonoNs end_ = kNever;
  std::map<int, Sent> sent_;   // by the link's number
  std::int64_t suspect_ = -1;  // the oldest unconfirmed message when a connection ended
  std::string refusal_;        // the newest of this connection
  int tries_ = 0;              // consecutive connections that ended with it unconfirmed
  mutable std::mutex mutex_;
  BrokerStatus status_;
};

}  // namespace axlecast
