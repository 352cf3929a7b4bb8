#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "platform/net/lcm_port.h"
#include "platform/net/multicast_port.h"
#include "platform/net/udpm_receiver.h"
#include "tools/log/channel_filter.h"
#include "tools/recorder/message_queue.h"

namespace axlecast {

// Received and missing messages.
struct ReceiverCounts {
  std::int64_t received = 0;         // messages, selected or not
  std::int64_t lost = 0;             // messages, by the gaps in the senders' numbers
  std::int64_t overflow = 0;         // selected messages that found no space in the queue
  std::int64_t kernel_dropped = 0;   // datagrams; if their gap was detected, they are in `lost` as well
  std::int64_t not_lcm = 0;          // datagrams that are not LCM's
  std::vector<SenderCount> senders;  // greatest loss first; overflow counts as lost
};

// Counts the messages of each sender that found no space in the queue. Senders can be invented, so their number is limited:
// messages of further senders are not counted.
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

// Receives messages from LCM and puts the selected ones into a queue. It never waits for the reader of the queue. counts() and
// iterations() are thread-safe. All other functions belong to one thread.
class MessageReceiver {
 public:
  MessageReceiver(ChannelFilter filter, MessageQueue& queue, const Clock& clock);

  // Starts to receive on the URL.
  [[nodiscard]] Result<> Listen(const std::string& url);
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

  // Receives until `stop` is readable, and then the messages that had arrived by that time. Returns an error if receiving failed.
  [[nodiscard]] Result<> Run(int stop);

  [[nodiscard]] ReceiverCounts counts() const;
  // Returns the number of iterations of Run's loop: at least ten per second, unless it hangs.
  [[nodiscard]] std::uint64_t iterations() const { return iterations_; }

 private:
  struct Source {
    MulticastPort port;
    UdpmReceiver receiver;
    std::int64_t dropped = 0;
  };

  // A source that liblcm receives.
  struct OtherSource {
    explicit OtherSource(const std::string& lcm_url) : url(lcm_url), port(lcm_url, "") {}

    std::string url;
    LcmPort port;
  };

  [[nodiscard]] Result<> ListenByLcm(const std::string& url);
  // Returns the number of datagrams that were received no later than `until` (us, UNIX time).
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
  std::atomic<std::uint64_t> iterations_ = 0;
  mutable std::mutex mutex_;
  std::int64_t from_others_ = 0;
  std::int64_t overflow_ = 0;
  OverflowTally overflow_tally_;
};

}  // namespace axlecast
