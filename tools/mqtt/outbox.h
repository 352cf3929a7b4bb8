#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "core/messages/broker_link.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Which messages of a topic are kept while the broker is not available.
enum class RetentionClass : std::uint8_t {
  kNewest,   // a state: a newer message replaces it
  kEvents,   // all, in order
  kSamples,  // all, in order; shed first
};
inline constexpr std::size_t kKeepings = 3;

struct OutboxCounts {
  std::int64_t messages = 0;                   // queued or unconfirmed
  std::int64_t bytes = 0;                      // of these
  std::int64_t put = 0;                        // since the start, as all below
  std::int64_t taken = 0;                      // confirmed by the broker
  std::int64_t replaced = 0;                   // states replaced by a newer one before they were sent
  std::array<std::int64_t, kKeepings> shed{};  // dropped because the outbox was full, by RetentionClass
  std::int64_t refused = 0;                    // refused by the broker

  [[nodiscard]] std::int64_t Lost() const { return shed[0] + shed[1] + shed[2] + refused; }
};

// A queue of messages to a broker, bounded by number and bytes. If it is full, the oldest sample is dropped first, then the
// oldest event, then the oldest state. Unconfirmed messages are never dropped; after Return, they are sent again.
// Thread-safe.
class Outbox {
 public:
  struct Limits {
    std::size_t messages;
    std::size_t bytes;
  };
  struct Next {
    std::int64_t id;
    BrokerMessage message;
  };

  explicit Outbox(Limits limits);

  void Put(BrokerMessage message, RetentionClass keeping);

  // Returns the oldest queued message, which is then unconfirmed.
  [[nodiscard]] std::optional<Next> Take();
  void Confirm(std::int64_t id);
  void Refuse(std::int64_t id);
  // Queues all unconfirmed messages again, in their order.
  void Return();

  [[nodiscard]] OutboxCounts counts() const;
  [[nodiscard]] int FileDescriptor() const {
    return event_.FileDescriptor();
  }  // readable while messages are queued

 private:
  struct Entry {
    BrokerMessage message;
    RetentionClass keeping;
  };
  using Entries = std::map<std::int64_t, Entry>;

  void Erase(Entries::iterator entry);
  void MakeRoom(std::size_t bytes);
  [[nodiscard]] bool Shed(RetentionClass keeping);
  void Signal();

  const Limits limits_;
  WakeEvent event_;
  mutable std::mutex mutex_;
  Entries entries_;                                          // by id, which is the order
  std::array<std::set<std::int64_t>, kKeepings> waiting_;    // ids by RetentionClass
  std::map<std::string, std::int64_t, std::less<>> newest_;  // of each topic of a state, the id that waits
  std::int64_t next_id_ = 0;
  bool signalled_ = false;
  OutboxCounts counts_;
};

}  // namespace axlecast
