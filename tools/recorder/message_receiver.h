#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/messages/machine_filter.h"
#include "platform/net/lcm_port.h"
#include "platform/net/multicast_port.h"
#include "platform/net/udpm_receiver.h"
#include "platform/os/descriptor.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Messages in the order in which they were added, in one block of memory.
class MessageBatch {
 public:
  void Add(const LogEvent& message);
  // Returns the next message, or nothing at the end. Its views refer to the batch.
  [[nodiscard]] std::optional<LogEvent> Next();
  [[nodiscard]] std::int64_t left() const { return left_; }  // messages that Next has not returned yet
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }
  void Clear();

 private:
  struct Head {
    std::int64_t utime;
    std::uint32_t channel_size;
    std::uint32_t data_size;
  };

  std::vector<std::uint8_t> bytes_;
  std::size_t position_ = 0;
  std::int64_t left_ = 0;
};

// Passes messages from a thread that must not wait to a thread that may wait. Its size is limited; the caller counts the messages
// that find no space.
class MessageQueue {
 public:
  explicit MessageQueue(std::size_t limit);  // bytes; uses at most about twice this memory

  // Returns false if the queue is full.
  [[nodiscard]] bool Add(const LogEvent& message);
  // Ends the queue: Take returns false once it is empty.
  void Close();

  // Moves all waiting messages into `batch`, and reuses the memory of `batch`. Returns false if the queue is closed and empty.
  [[nodiscard]] bool Take(MessageBatch& batch);
  // Readable while Take has something to return.
  [[nodiscard]] int FileDescriptor() const { return event_.FileDescriptor(); }

 private:
  std::size_t limit_;
  WakeEvent event_;
  std::mutex mutex_;
  MessageBatch waiting_;
  bool closed_ = false;
};

// Received and missing messages.
struct ReceiverCounts {
  std::int64_t received = 0;           // messages, selected or not
  std::int64_t lost = 0;               // messages, by the gaps in the senders' numbers
  std::int64_t overflow = 0;           // selected messages that found no space in the queue
  std::int64_t kernel_dropped = 0;     // datagrams; if their gap was detected, they are in `lost` as well
  std::int64_t not_lcm = 0;            // datagrams that are not LCM's
  std::vector<SenderCount> senders;    // greatest loss first; overflow counts as lost
  std::vector<OtherMachine> machines;  // other machines whose messages were refused, and are arriving
  std::string network;                 // ReceptionCounts::network
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
  // With `machine`, a name, messages that state another machine are refused.
  MessageReceiver(ChannelFilter filter, std::string_view machine, MessageQueue& queue, const Clock& clock);

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
  void CountDrops();
  void Drain();
  void Take(const ReceivedMessage& message);

  ChannelFilter filter_;
  MachineFilter machines_;
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
