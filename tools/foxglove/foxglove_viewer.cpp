#include "tools/foxglove/foxglove_viewer.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

constexpr std::size_t kOverhead = 64;  // bytes of memory for a message that waits, besides its payload

}  // namespace

void FoxgloveViewer::Add(std::string text) {
  text_bytes_ += text.size();
  texts_.push_back(std::move(text));
}

Result<> FoxgloveViewer::Subscribe(FoxgloveSubscribe::One subscription, bool known) {
  const std::string ignored = ": subscription " + std::to_string(subscription.subscription) + " is ignored";
  if (!known) return Failure("channel " + std::to_string(subscription.channel) + " is not advertised" + ignored);
  if (channels_.contains(subscription.subscription)) return Failure("its number is in use" + ignored);
  if (channels_.size() >= kMaxSubscriptions) return Failure("more than 10000 subscriptions" + ignored);
  channels_[subscription.subscription] = subscription.channel;
  subscriptions_[subscription.channel].push_back(subscription.subscription);
  return {};
}

Result<> FoxgloveViewer::Unsubscribe(std::uint32_t subscription) {
  const auto found = channels_.find(subscription);
  if (found == channels_.end()) return Failure("there is no subscription " + std::to_string(subscription));
  const auto channel = subscriptions_.find(found->second);
  std::erase(channel->second, subscription);
  if (channel->second.empty()) subscriptions_.erase(channel);
  channels_.erase(found);
  return {};
}

void FoxgloveViewer::Forget(std::uint32_t channel) {
  subscriptions_.erase(channel);
  std::erase_if(channels_, [channel](const auto& each) { return each.second == channel; });
}

void FoxgloveViewer::Add(std::uint32_t channel, std::uint64_t time_ns,
                         const std::shared_ptr<const std::string>& payload, bool kept) {
  const auto found = subscriptions_.find(channel);
  if (found == subscriptions_.end()) return;
  for (const std::uint32_t subscription : found->second) {
    bytes_ += payload->size() + kOverhead;
    (kept ? kept_ : others_).push_back({subscription, time_ns, payload, order_++});
  }
  while (bytes_ > kMaxWaiting) DropOldest();
}

void FoxgloveViewer::DropOldest() {
  std::deque<Waiting>& from = others_.empty() ? kept_ : others_;
  bytes_ -= from.front().payload->size() + kOverhead;
  from.pop_front();
  ++dropped_;
}

std::optional<FoxgloveFrame> FoxgloveViewer::Next(MonoNs now) {
  if (dropped_ > reported_ && now >= next_report_) {
    next_report_ = now + kReportEvery;
    reported_ = dropped_;
    Add(FoxgloveStatus(
        FoxgloveLevel::kWarning,
        std::to_string(dropped_) + " messages were dropped, because this viewer is slower than they come",
        "dropped"));
  }
  if (!texts_.empty()) {
    FoxgloveFrame frame{std::move(texts_.front()), false};
    texts_.pop_front();
    text_bytes_ -= frame.text.size();
    return frame;
  }
  const bool kept = !kept_.empty() && (others_.empty() || kept_.front().order < others_.front().order);
  std::deque<Waiting>& from = kept ? kept_ : others_;
  if (from.empty()) return std::nullopt;
  const Waiting waiting = std::move(from.front());
  from.pop_front();
  bytes_ -= waiting.payload->size() + kOverhead;
  return FoxgloveFrame{FoxgloveMessageHead(waiting.subscription, waiting.time_ns) + *waiting.payload, true};
}

}  // namespace axlecast
