#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "platform/net/multicast_port.h"
#include "platform/net/reception_report.h"
#include "platform/net/udpm_receiver.h"
#include "platform/os/system_clock.h"

namespace axlecast {

// Receives a udpm:// URL for one process: datagrams are checked, put together and counted, in bounded memory. Sends
// nothing. One thread, but counts() is thread-safe.
class LcmReceiver {
 public:
  using Sink = std::function<void(std::string_view channel, Bytes message)>;

  // axlecast's own messages fit one datagram; fragments are other people's.
  static constexpr FragmentLimits kFragments = {.total = 2U << 20, .older = 256U << 10};
  static constexpr std::size_t kPerRead = MulticastPort::kMaxPerRead;

  explicit LcmReceiver(const LcmUrl& url);

  [[nodiscard]] const std::string& problem() const { return port_.problem(); }
  [[nodiscard]] const std::string& warning() const { return port_.warning(); }
  [[nodiscard]] int FileDescriptor() const { return port_.FileDescriptor(); }

  // Hands over the messages of at most kPerRead datagrams that wait; returns the number of datagrams.
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
};

}  // namespace axlecast
