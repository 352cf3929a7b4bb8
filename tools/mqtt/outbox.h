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

// What is kept of a topic while the broker takes nothing.
enum class RetentionClass : std::uint8_t {
  kNewest,   // a state: what is newer replaces it
  kEvents,   // each of them, in order
  kSamples,  // each of them, in order; the first to be shed
};
inline constexpr std::size_t kKeepings = 3;

struct OutboxCounts {
  std::int64_t messages = 0;                   // that wait or are on their way
  std::int64_t bytes = 0;                      // of these
  std::int64_t put = 0;                        // since the start, as all below
  std::int64_t taken = 0;                      // the broker has them
  std::int64_t replaced = 0;                   // states that a newer one has replaced before they were sent
  std::array<std::int64_t, kKeepings> shed{};  // for want of room, by RetentionClass
  std::int64_t refused = 0;                    // the broker does not want them

  [[nodiscard]] std::int64_t Lost() const { return shed[0] + shed[1] + shed[2] + refused; }
};

// Messages on their way to a broker, in the order in which they were put, bounded by number and bytes. When it is full
// the oldest sample goes first, then the oldest event, then the oldest state. What was given to the broker and not yet
// confirmed stays, is never shed, and is given again after Return. Thread-safe.
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

  // The oldest that waits; it is on its way then.
  [[nodiscard]] std::optional<Next> Take();
  void Confirm(std::int64_t id);
  void Refuse(std::int64_t id);
  // Nothing is on its way any more: all that was waits again, in its place.
  void Return();

  [[nodiscard]] OutboxCounts counts() const;
  [[nodiscard]] int FileDescriptor() const { return event_.FileDescriptor(); }  // readable when something waits

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
