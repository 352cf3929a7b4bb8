#include "tools/mqtt/broker_session.h"

#include <algorithm>
#include <utility>

namespace axlecast {

BrokerSession::BrokerSession(BrokerLink& link, Outbox& outbox, BrokerStatusMessages status)
    : link_(link), outbox_(outbox), own_(std::move(status)) {}

MonoNs BrokerSession::Step(MonoNs now) {
  for (const BrokerEvent& event : link_.Poll()) On(event, now);
  if (state_ == State::kWaiting && now >= deadline_) {
    state_ = State::kConnecting;
    deadline_ = now + kAnswer;
    link_.Connect({own_.topic, own_.offline, true});
    for (const BrokerEvent& event : link_.Poll()) On(event, now);
  }
  CheckAnswers(now);
  if (state_ == State::kConnected) {
    if (now >= next_status_) {
      SendOwn(own_.online(), now);
      next_status_ = now + kStatusEvery;
    }
    SendWaiting(now);
    if (end_ != kNever && (sent_.empty() || now >= end_)) Leave(now);
  }
  if (state_ == State::kLeaving && (sent_.empty() || now >= deadline_)) {
    link_.Disconnect(false);
    state_ = State::kEnded;
  }
  for (const BrokerEvent& event : link_.Poll()) On(event, now);
  return NextStep();
}

void BrokerSession::On(const BrokerEvent& event, MonoNs now) {
  switch (event.kind) {
    case BrokerEvent::Kind::kConnected:
      if (state_ != State::kConnecting) return;
      state_ = State::kConnected;
      connected_at_ = now;
      next_status_ = now;
      SetConnected(true, now);
      return;
    case BrokerEvent::Kind::kDown:
      OnDown(event.text, now, event.fault);
      return;
    case BrokerEvent::Kind::kReceived:  // nothing is subscribed
      return;
    case BrokerEvent::Kind::kTaken:
    case BrokerEvent::Kind::kRefused:
      const auto found = sent_.find(event.message);
      if (found == sent_.end()) return;
      const Sent sent = found->second;
      sent_.erase(found);
      if (sent.id == suspect_) suspect_ = -1;
      if (event.kind == BrokerEvent::Kind::kRefused) return OnRefused(sent, event.text);
      outbox_.Confirm(sent.id);
      return;
  }
}

void BrokerSession::OnRefused(const Sent& sent, const std::string& text) {
  outbox_.Refuse(sent.id);
  refusal_ = "the broker refuses messages: " + text;
  const std::scoped_lock lock(mutex_);
  status_.problem = refusal_;
}

void BrokerSession::OnDown(const std::string& text, MonoNs now, bool fault) {
  if (state_ == State::kEnded) return;
  const bool was_connected = state_ == State::kConnected || state_ == State::kLeaving;
  // If the broker breaks the protocol, no message is the cause, and no message is refused.
  if (was_connected && !fault) SuspectOldest();
  if (was_connected && now - connected_at_ >= kStable) pause_ = kFirstPause;
  sent_.clear();
  outbox_.Return();
  link_.Drop();
  {
    const std::scoped_lock lock(mutex_);
    status_.problem = refusal_.empty() ? text : text + "; before, " + refusal_;
  }
  refusal_.clear();
  if (was_connected) SetConnected(false, now);
  state_ = end_ == kNever ? State::kWaiting : State::kEnded;
  deadline_ = now + pause_;
  pause_ = std::min(2 * pause_, kLongestPause);
}

// Detects a message at which the broker ends each connection, so that it does not block all others.
void BrokerSession::SuspectOldest() {
  std::int64_t oldest = -1;
  for (const auto& [number, sent] : sent_) {
    if (sent.id != kOwn && (oldest < 0 || sent.id < oldest)) oldest = sent.id;
  }
  tries_ = oldest >= 0 && oldest == suspect_ ? tries_ + 1 : 1;
  suspect_ = oldest;
  if (suspect_ < 0 || tries_ < kMaxTries) return;
  outbox_.Refuse(suspect_);
  suspect_ = -1;
}

void BrokerSession::SendOwn(std::string payload, MonoNs now) {
  sent_[link_.Send({own_.topic, std::move(payload), true})] = {kOwn, now};
}

// While a message is suspect, only one message is sent at a time: if a broker closes a connection with unread bytes, its
// answer is lost.
bool BrokerSession::HasRoom() const {
  if (suspect_ < 0) return sent_.size() < kWindow;
  return std::all_of(sent_.begin(), sent_.end(), [](const auto& sent) { return sent.second.id == kOwn; });
}

void BrokerSession::SendWaiting(MonoNs now) {
  while (HasRoom() && now < end_) {
    const std::optional<Outbox::Next> next = outbox_.Take();
    if (!next) return;
    sent_[link_.Send(next->message)] = {next->id, now};
  }
}

void BrokerSession::Leave(MonoNs now) {
  state_ = State::kLeaving;
  deadline_ = now + kSecond;
  SendOwn(own_.ended(), now);
}

void BrokerSession::CheckAnswers(MonoNs now) {
  if (state_ == State::kConnecting && now >= deadline_) {
    OnDown("the broker does not answer: is it an MQTT broker, with or without TLS as configured?", now);
  } else if (state_ == State::kConnected && std::any_of(sent_.begin(), sent_.end(), [now](const auto& sent) {
               return now - sent.second.at >= kConfirmation;
             })) {
    OnDown("the broker does not confirm messages", now);
  }
}

void BrokerSession::End(MonoNs deadline) {
  end_ = deadline;
  if (state_ == State::kConnected) return;
  link_.Drop();
  state_ = State::kEnded;
}

MonoNs BrokerSession::NextStep() const {
  switch (state_) {
    case State::kWaiting:
    case State::kConnecting:
    case State::kLeaving:
      return deadline_;
    case State::kConnected:
      break;
    case State::kEnded:
      return kNever;
  }
  MonoNs next = std::min(next_status_, end_);
  for (const auto& [number, sent] : sent_) next = std::min(next, sent.at + kConfirmation);
  return next;
}

void BrokerSession::SetConnected(bool connected, MonoNs now) {
  const std::scoped_lock lock(mutex_);
  status_.connected = connected;
  status_.since = now;
  if (!connected) return;
  status_.problem.clear();
  ++status_.connections;
}

BrokerStatus BrokerSession::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

}  // namespace axlecast
