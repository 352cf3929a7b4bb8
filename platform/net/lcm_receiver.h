#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "platform/net/channel_pattern.h"
#include "platform/net/lcm_port.h"
#include "platform/net/multicast_port.h"
#include "platform/net/udpm_receiver.h"
#include "platform/os/system_clock.h"

namespace axlecast {

// The handlers of the subscribed channels. The matching patterns of the newest names are stored in a table of fixed size. A name
// that is not in the table costs time, but no message is lost. Used by one thread.
class ChannelSubscriptions {
 public:
  using Handler = std::function<void(const std::string& channel, Bytes message)>;
  static constexpr std::size_t kRememberedNames = 1'024;

  // `prefix` is added to every pattern as text, and removed from the names for handlers.
  explicit ChannelSubscriptions(std::string prefix) : prefix_(std::move(prefix)) {}

  // `pattern` is a regular expression (ECMAScript) over the whole name behind the prefix. Returns false if it is
  // invalid.
  bool Add(const std::string& pattern, Handler handler);

  // Calls every handler whose pattern matches, in the order in which they were added. Returns their number.
  std::size_t Dispatch(std::string_view channel, Bytes message);

  [[nodiscard]] bool empty() const { return subscriptions_.empty(); }
  [[nodiscard]] std::size_t memory() const;  // approximate bytes of the stored names

 private:
  struct Subscription {
    ChannelPattern pattern;
    Handler handler;
  };
  struct Remembered {
    std::string channel;                  // with the prefix; empty: unused
    std::string name;                     // without it
    std::vector<std::uint16_t> matching;  // in subscriptions_
  };

  const Remembered& Find(std::string_view channel);

  std::string prefix_;
  std::vector<Subscription> subscriptions_;
  std::vector<Remembered> remembered_;  // by the hash of the name
};

// Receives a udpm:// URL: checks, joins and counts datagrams, in bounded memory. Sends nothing. Used by one thread, except counts().
class LcmReceiver {
 public:
  using Sink = std::function<void(std::string_view channel, Bytes message)>;

  // The messages of axlecast fit one datagram. Fragments come from other programs.
  static constexpr FragmentLimits kFragments = {.total = 2U << 20, .older = 256U << 10};
  static constexpr std::size_t kPerRead = MulticastPort::kMaxPerRead;

  explicit LcmReceiver(const LcmUrl& url);

  [[nodiscard]] const std::string& problem() const { return port_.problem(); }
  [[nodiscard]] const std::string& warning() const { return port_.warning(); }
  [[nodiscard]] int FileDescriptor() const { return port_.FileDescriptor(); }

  // Passes the messages of at most kPerRead waiting datagrams to `sink`. Returns the number of datagrams.
  std::size_t Read(const Sink& sink);

  [[nodiscard]] ReceptionCounts counts() const;

 private:
  void Count(MonoNs now);

  const SystemClock clock_;
  MulticastPort port_;
  UdpmReceiver receiver_;
  MonoNs next_count_ = 0;
  std::atomic<std::int64_t> messages_ = 0;
  std::atomic<std::int64_t> dropped_ = 0;
  std::atomic<std::int64_t> outside_ = 0;
  std::atomic<std::int64_t> malformed_ = 0;
  mutable std::mutex mutex_;
  std::string network_;  // MulticastPort::network_problem, for counts
};

}  // namespace axlecast
