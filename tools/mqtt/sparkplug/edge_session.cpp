#include "tools/mqtt/sparkplug/edge_session.h"

#include <algorithm>
#include <utility>

namespace axlecast {

EdgeSession::EdgeSession(BrokerLink& link, SampleLog& log, EdgeNode& node, BirthSequence& birth_sequence,
                         std::function<MonoNs()> jitter)
    : link_(link), log_(log), node_(node), birth_sequence_(birth_sequence), jitter_(std::move(jitter)) {}

MonoNs EdgeSession::Step(Timestamp now) {
  for (const BrokerEvent& event : link_.Poll()) On(event, now);
  if (state_ == State::kWaiting && now.mono >= deadline_) Connect(now);
  CheckAnswers(now);
  if (state_ == State::kLive && now.mono >= rebirth_at_) {
    last_rebirth_ = now.mono;
    ++counts_.rebirths;
    SendBirths(now);
  }
  if (IsSending()) {
    SendBacklog(now);
    if (backlog_.empty()) Send(node_.Deaths(now));
    RequestConfirmation(now.mono);
  }
  for (const BrokerEvent& event : link_.Poll()) On(event, now);
  if (state_ == State::kLeaving && (awaited_.empty() || now.mono >= deadline_)) {
    link_.Disconnect(true);
    OnDown({.kind = BrokerEvent::Kind::kDown, .text = ending_ ? "" : "the primary host is offline"}, now);
  }
  log_.Poll(now.mono);
  return NextStep(now.mono);
}

void EdgeSession::On(const BrokerEvent& event, Timestamp now) {
  switch (event.kind) {
    case BrokerEvent::Kind::kConnected:
      return OnConnected(now);
    case BrokerEvent::Kind::kTaken:
      return OnTaken(event.message, now);
    case BrokerEvent::Kind::kRefused:
      if (std::find(awaited_.begin(), awaited_.end(), event.message) == awaited_.end()) return;
      return OnDown({.kind = BrokerEvent::Kind::kDown,
                     .text = "the broker refuses a subscription (" + event.text + "): let this user read " +
                             node_.topics().node_command() +
                             (node_.topics().host_state().empty() ? "" : " and " + node_.topics().host_state())},
                    now);
    case BrokerEvent::Kind::kReceived:
      return OnReceived(event, now);
    case BrokerEvent::Kind::kDown:
      return OnLost(event, now);
  }
}

void EdgeSession::Connect(Timestamp now) {
  state_ = State::kConnecting;
  deadline_ = now.mono + kAnswer;
  node_.BeginSession(birth_sequence_.Next());
  link_.Connect(node_.Death(now.utime / 1'000));
}

void EdgeSession::OnConnected(Timestamp now) {
  if (state_ != State::kConnecting) return;
  state_ = State::kSubscribing;
  deadline_ = now.mono + kAnswer;
  connected_at_ = now.mono;
  host_.Reset();
  awaited_ = {link_.Subscribe(node_.topics().node_command())};
  if (!node_.topics().host_state().empty()) awaited_.push_back(link_.Subscribe(node_.topics().host_state()));
  SetConnected(true, now.mono);
}

void EdgeSession::OnTaken(int number, Timestamp now) {
  std::erase(awaited_, number);
  if (state_ == State::kSubscribing && awaited_.empty()) {
    state_ = State::kHostOffline;
    if (node_.topics().host_state().empty() || host_.online()) return BeginLive(now);
    ++counts_.host_waits;
  }
  if (!barrier_ || barrier_->number != number) return;
  log_.Confirm(barrier_->upto, barrier_->utime);
  unconfirmed_ -= barrier_->messages;
  barrier_.reset();
}

void EdgeSession::OnReceived(const BrokerEvent& event, Timestamp now) {
  switch (node_.topics().KindOf(event.topic)) {
    case SparkplugTopics::Received::kNodeCommand:
      return OnCommand(event, now);
    case SparkplugTopics::Received::kHostState:
      return OnHostState(event, now);
    case SparkplugTopics::Received::kOther:
      ++counts_.ignored;
  }
}

// Data stops at once. A retained command is older than this session.
void EdgeSession::OnCommand(const BrokerEvent& event, Timestamp now) {
  const auto metrics = event.retained ? std::nullopt : DecodePayload(event.text);
  const bool is_rebirth =
      metrics && std::any_of(metrics->begin(), metrics->end(), [](const ReceivedMetric& metric) {
        return metric.name == kRebirthMetric && metric.boolean == true;
      });
  if (!is_rebirth || state_ != State::kLive) {
    ++counts_.ignored;
    return;
  }
  if (rebirth_at_ == kNever) rebirth_at_ = std::max(now.mono + jitter_(), last_rebirth_ + kRebirthEvery);
}

void EdgeSession::OnHostState(const BrokerEvent& event, Timestamp now) {
  const std::optional<HostState> state = ParseHostState(event.text);
  if (!state || !host_.On(*state)) {
    if (!state) ++counts_.ignored;
    return;
  }
  if (host_.online() && state_ == State::kHostOffline) BeginLive(now);
  if (!host_.online() && state_ == State::kLive) Leave(now);
}

void EdgeSession::BeginLive(Timestamp now) {
  state_ = State::kLive;
  backlog_.clear();
  const std::int64_t resume = log_.Resume();
  if (resume < log_.next()) backlog_.push_back({resume, log_.next()});
  SendBirths(now);
}

void EdgeSession::SendBirths(Timestamp now) {
  rebirth_at_ = kNever;
  ++counts_.births;
  // Historical samples are of every device, and a device must be born before its data.
  Send(node_.Births(!backlog_.empty(), now));
}

void EdgeSession::OnSample(std::string_view channel, Bytes message, Timestamp now) {
  if (!node_.Publishes(channel)) return;
  const std::int64_t number = log_.Append(channel, message, now.utime, now.mono);
  const bool live = IsSending() && HasRoom();
  Send(node_.OnSample(channel, message, live, now));
  if (live) {
    ++counts_.live;
    if (backlog_.empty()) newest_utime_ = now.utime;
  } else if (state_ == State::kLive) {
    if (backlog_.empty() || backlog_.back().to != number) backlog_.push_back({number, number});
    backlog_.back().to = number + 1;
  }
}

void EdgeSession::Send(const std::vector<BrokerMessage>& messages) {
  for (const BrokerMessage& message : messages) static_cast<void>(link_.Send(message));
  unconfirmed_ += static_cast<std::int64_t>(messages.size());
  unbarred_ += static_cast<std::int64_t>(messages.size());
}

void EdgeSession::SendBacklog(Timestamp now) {
  while (!backlog_.empty() && HasRoom()) {
    Range& range = backlog_.front();
    const std::vector<StoredSample> samples = log_.Read(range.from, range.to, kBatch);
    Send(node_.Historical(samples, now));
    counts_.historical += static_cast<std::int64_t>(samples.size());
    if (!samples.empty()) newest_utime_ = samples.back().utime;
    range.from = samples.size() < kBatch ? range.to : samples.back().number + 1;
    if (range.from >= range.to) backlog_.pop_front();
  }
}

void EdgeSession::RequestConfirmation(MonoNs now) {
  if (barrier_ || unbarred_ == 0 || (now < next_barrier_ && HasRoom())) return;
  next_barrier_ = now + kConfirmEvery;
  barrier_ = {.number = link_.Subscribe(node_.topics().node_command()),
              .messages = std::exchange(unbarred_, 0),
              .upto = backlog_.empty() ? log_.next() : backlog_.front().from,
              .utime = newest_utime_,
              .at = now};
}

void EdgeSession::Leave(Timestamp now) {
  state_ = State::kLeaving;
  deadline_ = now.mono + kSecond;
  awaited_ = {link_.Send(node_.Death(now.utime / 1'000))};
  // The broker confirms NDEATH, and has then all that was sent before.
  barrier_ = {.number = awaited_.front(),
              .messages = unconfirmed_,
              .upto = backlog_.empty() ? log_.next() : backlog_.front().from,
              .utime = newest_utime_,
              .at = now.mono};
}

void EdgeSession::OnDown(const BrokerEvent& event, Timestamp now) {
  if (state_ == State::kEnded) return;
  const bool was_connected = state_ != State::kWaiting && state_ != State::kConnecting;
  if (was_connected && now.mono - connected_at_ >= kStable) pause_ = kFirstPause;
  link_.Drop();
  status_.problem = event.text;
  if (was_connected) SetConnected(false, now.mono);
  backlog_.clear();
  awaited_.clear();
  barrier_.reset();
  unconfirmed_ = 0;
  unbarred_ = 0;
  rebirth_at_ = kNever;
  state_ = ending_ ? State::kEnded : State::kWaiting;
  deadline_ = now.mono + pause_;
  pause_ = std::min(2 * pause_, kLongestPause);
}

// The link or the broker has ended the connection, or an attempt has failed.
void EdgeSession::OnLost(const BrokerEvent& event, Timestamp now) {
  const bool was_connected = state_ != State::kWaiting && state_ != State::kConnecting;
  const bool is_short = was_connected && !event.fault && now.mono - connected_at_ < kStable;
  OnDown(event, now);
  if (!was_connected) short_sessions_.clear();
  if (event.taken_over) takeovers_.push_back(now.mono);
  if (is_short) short_sessions_.push_back(now.mono);
  for (std::deque<MonoNs>* times : {&takeovers_, &short_sessions_}) {
    while (!times->empty() && now.mono - times->front() > kTakeoverTime) times->pop_front();
  }
  if (takeovers_.size() < kMaxTakeovers && short_sessions_.size() < kMaxShortSessions) return;
  failure_ = "the connection was lost " + std::to_string(std::max(takeovers_.size(), short_sessions_.size())) +
             " times in a minute, soon after it was established: another client seems to use the same client id. "
             "Give each "
             "bridge a client_id of its own, and each machine a node of its own";
  state_ = State::kEnded;
}

void EdgeSession::CheckAnswers(Timestamp now) {
  const auto fail = [&](const char* text) { OnDown({.kind = BrokerEvent::Kind::kDown, .text = text}, now); };
  if ((state_ == State::kConnecting || state_ == State::kSubscribing) && now.mono >= deadline_) {
    fail("the broker does not answer: is it an MQTT broker, with or without TLS as configured?");
  } else if (barrier_ && now.mono - barrier_->at >= kConfirmation) {
    fail("the broker does not confirm messages");
  }
}

void EdgeSession::End(Timestamp now) {
  ending_ = true;
  if (state_ == State::kLive) {
    if (IsSending()) SendBacklog(now);
    return Leave(now);
  }
  if (state_ == State::kLeaving) return;
  // Before the births, no host knows the node. The will is not needed.
  if (state_ == State::kHostOffline || state_ == State::kSubscribing) link_.Disconnect(false);
  link_.Drop();
  state_ = State::kEnded;
}

MonoNs EdgeSession::NextStep(MonoNs now) const {
  if (state_ == State::kEnded || state_ == State::kHostOffline) return kNever;
  if (state_ != State::kLive) return deadline_;
  MonoNs next = std::min(now + kSecond, rebirth_at_);
  if (barrier_)
    next = std::min(next, barrier_->at + kConfirmation);
  else if (unbarred_ > 0)
    next = std::min(next, next_barrier_);
  return next;
}

void EdgeSession::SetConnected(bool connected, MonoNs now) {
  status_.connected = connected;
  status_.since = now;
  if (!connected) return;
  status_.problem.clear();
  ++status_.connections;
}

}  // namespace axlecast
