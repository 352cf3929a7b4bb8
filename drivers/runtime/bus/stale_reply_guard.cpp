#include "drivers/runtime/bus/stale_reply_guard.h"

#include <algorithm>

namespace axlecast {
namespace {

// Address, function, first register and number of a Modbus write; a whole read has two bytes of CRC more.
constexpr std::size_t kHeadOfSecret = 6;
constexpr std::size_t kSizeOfRead = 8;

ReplyMatch Match(const ReplyShape& shape, Bytes request, Bytes reply) {
  return reply.empty() ? ReplyMatch::kNo : shape.match(request, reply);
}

// Returns how the event matches the reply that the exchange expects.
ReplyMatch MatchOwn(const Exchange& exchange, const Event& event) {
  if (exchange.shape.match == nullptr) {
    return event.kind == Event::Kind::kReply ? ReplyMatch::kYes : ReplyMatch::kNo;
  }
  const std::size_t begin = exchange.reply_begin == nullptr ? 0 : exchange.reply_begin(event.bytes);
  const ReplyMatch match = Match(exchange.shape, exchange.request, event.bytes.subspan(begin));
  // The first byte may be damaged, so that the begin was not recognised.
  if (match != ReplyMatch::kNo || begin == 0) return match;
  return Match(exchange.shape, exchange.request, event.bytes);
}

}  // namespace

void StaleReplyGuard::Start(MonoNs now) {
  unexpected_.Clear();
  if (started_) return;
  started_ = true;
  unknown_until_ = now + bound_;
}

bool StaleReplyGuard::Conflicts(const Held& held, const ReplyShape& shape) {
  const bool same = held.shape.reply == shape.reply;
  if (same && held.shape.interchangeable && shape.interchangeable) return false;
  return same || held.shape.refusal == shape.reply || (shape.exact && held.shape.refusal == shape.refusal);
}

MonoNs StaleReplyGuard::Look(const Exchange& exchange, MonoNs now) const {
  if (exchange.reply_length == nullptr) return now;
  MonoNs free_at = std::max(now, full_until_);
  for (std::size_t i = 0; i < count_; ++i) {
    if (Conflicts(held_[i], exchange.shape)) free_at = std::max(free_at, held_[i].until);
  }
  const bool unknown =
      std::any_of(devices_.begin(), devices_.end(), [](const PerDevice& device) { return device.unknown; });
  if (unknown && !exchange.shape.fresh && !exchange.shape.interchangeable)
    free_at = std::max(free_at, unknown_until_);
  return free_at;
}

void StaleReplyGuard::Ended(const Exchange& exchange, std::size_t device, const Event& event) {
  if (bound_ <= 0 || exchange.reply_length == nullptr) return;
  unexpected_.Clear();
  const MonoNs end = event.End();
  if (count_ > 0) Expire(end);
  if (event.kind == Event::Kind::kLinkDown) return Hold(exchange, device, end);
  const ReplyMatch match = MatchOwn(exchange, event);
  if (match == ReplyMatch::kYes) return OnOwnReply(exchange, device, event.sent.last);
  if (match == ReplyMatch::kDamaged) return;
  // A refusal, or bytes that are similar to a reply, are assigned to this request only if no other request is held.
  if (count_ == 0 && match != ReplyMatch::kNo) return;
  // The rest of a late reply may follow. Bytes that may hold a secret are not kept.
  if (!event.secret) unexpected_ = Frame(event.bytes.first(std::min(event.bytes.size(), kMaxFrame)));
  RecogniseAll();
  Hold(exchange, device, event.sent.last);
}

void StaleReplyGuard::OnOwnReply(const Exchange& exchange, std::size_t device, MonoNs sent) {
  if (exchange.shape.fresh) devices_[device].unknown = false;
  // It may be the reply to an earlier interchangeable request. Then this request is not answered yet.
  for (std::size_t i = 0; i < count_; ++i) {
    if (held_[i].device != device || held_[i].shape.reply != exchange.shape.reply) continue;
    Erase(i);
    return Hold(exchange, device, sent);
  }
}

void StaleReplyGuard::CameUnexpected(Bytes bytes, MonoNs now) {
  if (count_ > 0) Expire(now);
  if (count_ == 0) return;
  bytes = bytes.last(std::min(bytes.size(), kMaxFrame));
  if (bytes.size() > unexpected_.room()) {
    const Frame before = unexpected_;
    unexpected_.Clear();
    unexpected_.Append(Bytes(before).last(std::min(before.size(), kMaxFrame - bytes.size())));
  }
  unexpected_.Append(bytes);
  RecogniseAll();
}

void StaleReplyGuard::RecogniseAll() {
  while (RecogniseOne()) {
  }
}

bool StaleReplyGuard::RecogniseOne() {
  const Bytes bytes = unexpected_;
  for (std::size_t begin = 0; begin < bytes.size(); ++begin) {
    const std::size_t index = FindReplyAt(bytes.subspan(begin));
    if (index == count_) continue;
    const std::size_t device = held_[index].device;
    const std::size_t end = begin + held_[index].reply_length(bytes.subspan(begin));
    ++devices_[device].late;
    Erase(index);
    const Frame rest(bytes.subspan(end));
    unexpected_ = rest;
    return true;
  }
  return false;
}

// Returns the index of the oldest held request whose whole reply is at the begin of these bytes, or count_.
std::size_t StaleReplyGuard::FindReplyAt(Bytes bytes) const {
  for (std::size_t i = 0; i < count_; ++i) {
    const Held& held = held_[i];
    if (held.shape.match == nullptr) continue;
    const std::size_t length = held.reply_length(bytes);
    if (length == 0 || length > bytes.size()) continue;
    if (Match(held.shape, held.request, bytes.first(length)) == ReplyMatch::kYes) return i;
  }
  return count_;
}

void StaleReplyGuard::Hold(const Exchange& exchange, std::size_t device, MonoNs sent) {
  const MonoNs until = sent + bound_;
  if (count_ == kCapacity) {
    full_until_ = until;
    return;
  }
  Bytes request = exchange.request;
  // A longer request may contain a secret behind the part that its reply repeats.
  if (exchange.secret && request.size() > kSizeOfRead) request = request.first(kHeadOfSecret);
  held_[count_++] = {Frame(request), exchange.reply_length, exchange.shape, device, until};
}

void StaleReplyGuard::Expire(MonoNs now) {
  for (std::size_t i = count_; i-- > 0;) {
    if (held_[i].until <= now) Erase(i);
  }
}

void StaleReplyGuard::Erase(std::size_t index) {
  std::move(held_.begin() + static_cast<std::ptrdiff_t>(index) + 1,
            held_.begin() + static_cast<std::ptrdiff_t>(count_),
            held_.begin() + static_cast<std::ptrdiff_t>(index));
  --count_;
}

}  // namespace axlecast
