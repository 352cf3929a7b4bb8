#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/messages/broker_link.h"
#include "tools/mqtt/broker_session.h"
#include "tools/mqtt/sparkplug/birth_sequence.h"
#include "tools/mqtt/sparkplug/edge_node.h"
#include "tools/mqtt/sparkplug/host_state.h"
#include "tools/mqtt/sparkplug/sample_log.h"

namespace axlecast {

struct EdgeCounts {
  std::int64_t live = 0;        // samples that were published at once
  std::int64_t historical = 0;  // samples that were published later, also those that were sent again
  std::int64_t births = 0;      // complete sequences of births
  std::int64_t rebirths = 0;    // of these, on request
  std::int64_t host_waits = 0;  // times that it began to wait for the primary host
  std::int64_t ignored = 0;     // received messages without effect
};

// Connects an edge node to a broker: from CONNECT with the last will to the births, the data and the orderly end. Time is an
// argument. One thread.
//
// A sample is stored first. It is published at once in a session whose births are sent, and otherwise later, as a historical value.
// Data is sent with QoS 0, which no broker confirms. A subscription is confirmed, and a broker handles the packets of a connection in
// order: the subscription to NCMD is therefore repeated, at most once a second, and its confirmation confirms all samples before
// it. What is not confirmed when a connection ends is sent again as historical.
class EdgeSession {
 public:
  static constexpr MonoNs kAnswer = BrokerSession::kAnswer;
  static constexpr MonoNs kConfirmation = BrokerSession::kConfirmation;
  static constexpr MonoNs kFirstPause = BrokerSession::kFirstPause;
  static constexpr MonoNs kLongestPause = BrokerSession::kLongestPause;
  static constexpr MonoNs kStable = BrokerSession::kStable;
  static constexpr std::int64_t kWindow = 128;  // messages without confirmation
  static constexpr std::size_t kBatch = 100;    // historical samples that are read at a time
  static constexpr MonoNs kConfirmEvery = kSecond;
  static constexpr MonoNs kRebirthEvery = 5 * kSecond;
  // Within kTakeoverTime, so many of these events mean that another client has the same id: the broker reports a takeover, or
  // the connection is lost within kStable after it was established, and no attempt fails in between. mosquitto 2.0.11 does
  // not report the reason.
  static constexpr std::size_t kMaxTakeovers = 3;
  static constexpr std::size_t kMaxShortSessions = 5;
  static constexpr MonoNs kTakeoverTime = 60 * kSecond;

  // `jitter`: returns the time before the answer to a request for births, so that many nodes do not answer at once.
  EdgeSession(BrokerLink& link, SampleLog& log, EdgeNode& node, BirthSequence& birth_sequence,
              std::function<MonoNs()> jitter);

  // Runs the steps that are due. Returns the time of the next call; call it earlier if the link is readable.
  [[nodiscard]] MonoNs Step(Timestamp now);
  // Stores a message that was selected for publication, and publishes it if that is possible.
  void OnSample(std::string_view channel, Bytes message, Timestamp now);

  // Ends the session: publishes NDEATH and disconnects. Historical samples that still wait stay on the disk.
  void End(Timestamp now);
  [[nodiscard]] bool ended() const { return state_ == State::kEnded; }
  [[nodiscard]] const std::string& failure() const {
    return failure_;
  }  // why it ended by itself; empty: it did not

  [[nodiscard]] const BrokerStatus& status() const { return status_; }
  [[nodiscard]] const EdgeCounts& counts() const { return counts_; }
  [[nodiscard]] bool born() const { return state_ == State::kLive; }
  [[nodiscard]] bool waits_for_host() const { return state_ == State::kHostOffline; }
  // Returns true if every stored sample was published.
  [[nodiscard]] bool caught_up() const { return state_ == State::kLive && backlog_.empty(); }

 private:
  enum class State : std::uint8_t { kWaiting, kConnecting, kSubscribing, kHostOffline, kLive, kLeaving, kEnded };
  struct Range {  // numbers of samples, [from, to)
    std::int64_t from = 0;
    std::int64_t to = 0;
  };
  struct Barrier {  // a subscription whose confirmation confirms samples
    int number = 0;
    std::int64_t messages = 0;  // that were sent before it and after the previous one
    std::int64_t upto = 0;      // number of the first sample that it does not confirm
    std::int64_t utime = 0;     // of the newest sample that it confirms
    MonoNs at = 0;
  };

  void On(const BrokerEvent& event, Timestamp now);
  void Connect(Timestamp now);
  void OnConnected(Timestamp now);
  void OnTaken(int number, Timestamp now);
  void OnReceived(const BrokerEvent& event, Timestamp now);
  void OnCommand(const BrokerEvent& event, Timestamp now);
  void OnHostState(const BrokerEvent& event, Timestamp now);
  void OnLost(const BrokerEvent& event, Timestamp now);
  void OnDown(const BrokerEvent& event, Timestamp now);
  void BeginLive(Timestamp now);
  void SendBirths(Timestamp now);
  void Send(const std::vector<BrokerMessage>& messages);
  void SendBacklog(Timestamp now);
  void RequestConfirmation(MonoNs now);
  void Leave(Timestamp now);
  void CheckAnswers(Timestamp now);
  void SetConnected(bool connected, MonoNs now);
  [[nodiscard]] bool HasRoom() const { return unconfirmed_ < kWindow; }
  [[nodiscard]] bool IsSending() const { return state_ == State::kLive && rebirth_at_ == kNever; }
  [[nodiscard]] MonoNs NextStep(MonoNs now) const;

  BrokerLink& link_;
  SampleLog& log_;
  EdgeNode& node_;
  BirthSequence& birth_sequence_;
  std::function<MonoNs()> jitter_;
  State state_ = State::kWaiting;
  bool ending_ = false;
  MonoNs deadline_ = 0;  // of the pause, or of the broker's answer
  MonoNs pause_ = kFirstPause;
  MonoNs connected_at_ = 0;
  std::vector<int> awaited_;  // numbers of subscriptions, or of NDEATH, that are not confirmed
  PrimaryHost host_;
  MonoNs rebirth_at_ = kNever;
  MonoNs last_rebirth_ = -kRebirthEvery;
  std::deque<Range> backlog_;
  std::int64_t unconfirmed_ = 0;  // messages of data
  std::int64_t unbarred_ = 0;     // of these, after the last barrier
  std::optional<Barrier> barrier_;
  MonoNs next_barrier_ = 0;
  std::int64_t newest_utime_ = 0;      // us, of the newest sample that was published in order
  std::deque<MonoNs> takeovers_;       // that the broker has reported
  std::deque<MonoNs> short_sessions_;  // since the last attempt that failed
  std::string failure_;
  BrokerStatus status_;
  EdgeCounts counts_;
};

}  // namespace axlecast
