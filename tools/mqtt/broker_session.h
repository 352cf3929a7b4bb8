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

// How the connection to the broker stands.
struct BrokerStatus {
  bool connected = false;
  MonoNs since = 0;              // of `connected`
  std::int64_t connections = 0;  // since the start
  std::string problem;           // why there is none, or the newest that the broker refused; empty: nothing to tell
};

// What the session itself publishes on the machine's topic `status`, retained.
struct BrokerStatusMessages {
  std::string topic;
  std::string offline;                  // the will: nobody is there any more
  std::function<std::string()> online;  // how things stand
  std::function<std::string()> ended;   // it has ended orderly
};

// Carries an outbox to a broker: connects again and again, keeps a few messages on their way, sends again what a lost
// connection may have swallowed. No clock; everything but status() belongs to one thread.
class BrokerSession {
 public:
  static constexpr std::size_t kWindow = 20;       // messages on their way
  static constexpr MonoNs kAnswer = 10 * kSecond;  // a broker that answers later does not answer
  static constexpr MonoNs kConfirmation = 30 * kSecond;
  static constexpr MonoNs kFirstPause = kSecond / 2;  // between two attempts, doubling
  static constexpr MonoNs kLongestPause = 8 * kSecond;
  static constexpr MonoNs kStable = 10 * kSecond;  // a connection that lasted so long resets the pause
  static constexpr MonoNs kStatusEvery = 10 * kSecond;
  static constexpr int kMaxTries = 5;  // connections that ended over one and the same message

  BrokerSession(BrokerLink& link, Outbox& outbox, BrokerStatusMessages status);

  // Does what is due. Returns when it wants to be called at the latest; sooner when the link or the outbox has something.
  [[nodiscard]] MonoNs Step(MonoNs now);

  // From now on: sends what waits until `deadline`, then says goodbye.
  void End(MonoNs deadline);
  [[nodiscard]] bool ended() const { return state_ == State::kEnded; }

  // Whether it would take something from the outbox now.
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
  void Tell(bool connected, MonoNs now);

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
  std::int64_t suspect_ = -1;  // the oldest on its way when a connection ended
  std::string refusal_;        // of this connection, the newest
  int tries_ = 0;              // connections that ended so, one after the other
  mutable std::mutex mutex_;
  BrokerStatus status_;
};

}  // namespace axlecast
