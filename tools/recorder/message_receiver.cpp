#include "tools/recorder/message_receiver.h"

#include <poll.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

#include "platform/net/group_check.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kCountDrops = 100 * kMillisecond;
constexpr int kMaxBatches = 16;        // of one port, so that it does not starve the others
constexpr int kOthersQueue = 100'000;  // messages in liblcm's queue
constexpr int kMaxHandles = 1'000;     // calls at the end
constexpr std::int64_t kAnyTime = std::numeric_limits<std::int64_t>::max();

}  // namespace

void MessageBatch::Add(const LogEvent& message) {
  const Head head{message.utime, static_cast<std::uint32_t>(message.channel.size()),
                  static_cast<std::uint32_t>(message.data.size())};
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&head);
  bytes_.insert(bytes_.end(), bytes, bytes + sizeof head);
  bytes_.insert(bytes_.end(), message.channel.begin(), message.channel.end());
  bytes_.insert(bytes_.end(), message.data.begin(), message.data.end());
  ++left_;
}

std::optional<LogEvent> MessageBatch::Next() {
  if (left_ == 0) return std::nullopt;
  Head head;
  std::memcpy(&head, bytes_.data() + position_, sizeof head);
  const std::uint8_t* channel = bytes_.data() + position_ + sizeof head;
  position_ += sizeof head + head.channel_size + head.data_size;
  --left_;
  return LogEvent{.utime = head.utime,
                  .channel = AsText({channel, head.channel_size}),
                  .data = Bytes(channel + head.channel_size, head.data_size)};
}

void MessageBatch::Clear() {
  bytes_.clear();
  position_ = 0;
  left_ = 0;
}

MessageQueue::MessageQueue(std::size_t limit) : limit_(limit) {}

bool MessageQueue::Add(const LogEvent& message) {
  bool was_empty = false;
  {
    const std::scoped_lock lock(mutex_);
    if (waiting_.bytes() + message.channel.size() + message.data.size() > limit_) return false;
    was_empty = waiting_.left() == 0;
    waiting_.Add(message);
  }
  if (was_empty) event_.Set();
  return true;
}

void MessageQueue::Close() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
  }
  event_.Set();
}

bool MessageQueue::Take(MessageBatch& batch) {
  event_.Take();
  batch.Clear();
  const std::scoped_lock lock(mutex_);
  std::swap(batch, waiting_);
  if (closed_) event_.Set();  // the end must wake the reader as well
  return batch.left() > 0 || !closed_;
}

MessageReceiver::MessageReceiver(ChannelFilter filter, std::string_view machine, MessageQueue& queue,
                                 const Clock& clock)
    : filter_(std::move(filter)), machines_(machine), queue_(queue), clock_(clock) {}

Result<> MessageReceiver::Listen(const std::string& url) {
  const auto parsed = ParseLcmUrl(url);
  if (IsOtherProvider(url) || (parsed && parsed->in_process)) return ListenByLcm(url);
  if (Result<> multicast = CheckMulticast(url); !multicast) return multicast;
  Source& source = sources_.emplace_back(Source{MulticastPort(*parsed), UdpmReceiver(), 0});
  if (!source.port.warning().empty()) warnings_.push_back(url + ": " + source.port.warning());
  if (!source.port.problem().empty()) return Failure(url + ": " + source.port.problem());
  return {};
}

Result<> MessageReceiver::ListenByLcm(const std::string& url) {
  LcmPort& port = others_.emplace_back(url).port;
  if (!port.problem().empty()) return Failure(port.problem());
  const auto handler = [this](const std::string& channel, Bytes data) {
    ++from_others_;
    Take({{}, clock_.UtcMicroseconds(), channel, data});
  };
  if (!port.Subscribe(".*", handler, kOthersQueue)) return Failure("cannot subscribe on " + url);
  return {};
}

Result<> MessageReceiver::Run(int stop) {
  std::vector<pollfd> files = {{stop, POLLIN, 0}};
  for (const Source& source : sources_) files.push_back({source.port.FileDescriptor(), POLLIN, 0});
  for (const OtherSource& other : others_) files.push_back({other.port.FileDescriptor(), POLLIN, 0});
  MonoNs next_count = 0;
  for (; files[0].revents == 0; ++iterations_) {
    static_cast<void>(PollUntil(files, clock_.Now() + kCountDrops, clock_));
    for (Source& source : sources_) {
      for (int i = 0; i < kMaxBatches && ReadBatch(source, kAnyTime) == MulticastPort::kMaxPerRead; ++i) {
      }
    }
    for (OtherSource& other : others_) {
      const std::scoped_lock lock(mutex_);
      if (!other.port.Handle(0))
        return Failure("LCM failed on " + other.url + ": start its server, and record again");
    }
    if (clock_.Now() < next_count) continue;
    CountDrops();
    next_count = clock_.Now() + kCountDrops;
  }
  Drain();
  return {};
}

std::size_t MessageReceiver::ReadBatch(Source& source, std::int64_t until) {
  const auto batch = source.port.Read();
  const MonoNs now = clock_.Now();
  const std::scoped_lock lock(mutex_);
  std::size_t in_time = 0;
  for (const MulticastPort::Received& datagram : batch) {
    if (datagram.utime > until) break;
    ++in_time;
    source.receiver.On({datagram.sender, datagram.utime, now, datagram.bytes},
                       [this](const ReceivedMessage& message) { Take(message); });
  }
  return in_time;
}

void MessageReceiver::Take(const ReceivedMessage& message) {
  if (!filter_.Matches(message.channel)) return;
  if (!machines_.Takes(message.data)) return machines_.Refuse(message.data, clock_.Now());
  if (queue_.Add({.utime = message.utime, .channel = message.channel, .data = message.data})) return;
  ++overflow_;
  overflow_tally_.On(message.sender);
}

// Reads what had arrived when the stop was requested. With live traffic, a longer read would not end.
void MessageReceiver::Drain() {
  const std::int64_t until = clock_.UtcMicroseconds();
  for (Source& source : sources_) {
    while (ReadBatch(source, until) == MulticastPort::kMaxPerRead) {
    }
  }
  CountDrops();
  const std::scoped_lock lock(mutex_);
  for (OtherSource& other : others_) {
    std::int64_t before = -1;
    for (int i = 0; i < kMaxHandles && before != from_others_; ++i) {
      before = from_others_;
      static_cast<void>(other.port.Handle(0));
    }
  }
  for (Source& source : sources_) source.receiver.End();
}

void MessageReceiver::CountDrops() {
  const std::scoped_lock lock(mutex_);
  for (Source& source : sources_) source.dropped = source.port.Dropped();
}

ReceiverCounts MessageReceiver::counts() const {
  const std::scoped_lock lock(mutex_);
  ReceiverCounts counts;
  counts.received = from_others_;
  counts.overflow = overflow_;
  counts.machines = machines_.Others(clock_.Now());
  for (const Source& source : sources_) {
    counts.received += source.receiver.received();
    counts.lost += source.receiver.lost();
    counts.not_lcm += source.receiver.malformed();
    counts.kernel_dropped += source.dropped;
    if (counts.network.empty()) counts.network = source.port.network_problem();
    const std::vector<SenderCount> senders = source.receiver.senders();
    counts.senders.insert(counts.senders.end(), senders.begin(), senders.end());
  }
  for (SenderCount& sender : counts.senders) sender.lost += overflow_tally_.Of(sender.sender);
  std::stable_sort(counts.senders.begin(), counts.senders.end(),
                   [](const SenderCount& one, const SenderCount& other) { return one.lost > other.lost; });
  return counts;
}

}  // namespace axlecast
