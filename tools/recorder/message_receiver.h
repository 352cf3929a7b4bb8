#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "platform/net/lcm_port.h"
#include "platform/net/multicast_port.h"
#include "platform/net/udpm_receiver.h"
#include "tools/log/channel_filter.h"
#include "tools/recorder/message_queue.h"

namespace axlecast {

// What came and what is missing.
struct IntakeCounts {
  std::int64_t received = 0;         // messages, wanted or not
  std::int64_t lost = 0;             // by the gaps in the senders' numbers
  std::int64_t overflow = 0;         // wanted ones that found no room in the queue
  std::int64_t kernel_dropped = 0;   // datagrams; those whose gap shows are in `lost` as well
  std::int64_t foreign = 0;          // datagrams that are none of LCM's
  std::vector<SenderCount> senders;  // most lost first; overflow counts as lost
};

// Messages of each sender that found no room in the queue. Anybody may invent senders: further ones are not counted.
class OverflowTally {
 public:
  void On(const SenderAddress& sender) {
    if (counts_.size() < UdpmReceiver::kMaxSenders || counts_.contains(sender)) ++counts_[sender];
  }
  [[nodiscard]] std::int64_t Of(const SenderAddress& sender) const {
    const auto found = counts_.find(sender);
    return found == counts_.end() ? 0 : found->second;
  }
  [[nodiscard]] std::size_t senders() const { return counts_.size(); }

 private:
  std::map<SenderAddress, std::int64_t> counts_;
};

// The reading side: takes messages from LCM's ports as they come and puts those that are wanted into a queue. It never
// waits for who takes them out. counts() and turns() are thread-safe; the rest belongs to one thread.
class MessageReceiver {
 public:
  MessageReceiver(ChannelFilter filter, MessageQueue& queue, const Clock& clock);

  // Empty when messages can come from there, else the cause and the remedy.
  [[nodiscard]] std::string Listen(const std::string& url);
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  // Reads until `stop` is readable, then what had come by that time. Empty, or why it ended by itself.
  [[nodiscard]] std::string Run(int stop);

  [[nodiscard]] IntakeCounts counts() const;
  // Of the loop of Run: at least ten in a second, unless it hangs.
  [[nodiscard]] std::uint64_t turns() const { return turns_; }

 private:
  struct Source {
    MulticastPort port;
    UdpmReceiver receiver;
    std::int64_t dropped = 0;
  };

  // Read through LCM.
  struct OtherSource {
    explicit OtherSource(const std::string& lcm_url) : url(lcm_url), port(lcm_url, "") {}

    std::string url;
    LcmPort port;
  };

  [[nodiscard]] std::string ListenByLcm(const std::string& url);
  // The number of datagrams that came no later than `until` (us, UNIX).
  std::size_t ReadBatch(Source& source, std::int64_t until);
  void ReadAll(std::int64_t until);
  void CountDrops();
  void Drain();
  void Take(const ReceivedMessage& message);

  ChannelFilter filter_;
  MessageQueue& queue_;
  const Clock& clock_;
  std::list<Source> sources_;
  std::list<OtherSource> others_;
  std::vector<std::string> warnings_;
  std::atomic<std::uint64_t> turns_ = 0;
  mutable std::mutex mutex_;
  std::int64_t from_others_ = 0;
  std::int64_t overflow_ = 0;
  OverflowTally overflow_of_;
};

}  // namespace axlecast
