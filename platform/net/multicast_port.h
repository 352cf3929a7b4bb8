#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/messages/lcm_url.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The only place that receives the datagrams of LCM, with their senders, the timestamps of the kernel, and the count of datagrams
// that the kernel dropped. It receives only what was sent to the group, never a datagram to the address of this host. With ttl=0,
// it receives only what this host sent. The kernel determines this (a looped-back copy, or a datagram from lo), not the address
// of the sender, which can be forged. It sends nothing. Used by one thread.
class MulticastPort {
 public:
  static constexpr std::size_t kMaxPerRead = 16;            // 1 MiB of memory at most, even for the longest ones
  static constexpr std::int64_t kDefaultBuffer = 32 << 20;  // bytes, unless the URL has recv_buf_size

  struct Received {
    SenderAddress sender;
    // us, UNIX time of the reception by the kernel. If no other socket of the host requests timestamps, the kernel begins with
    // them shortly after the port was opened. Earlier datagrams have the time at which they were read.
    std::int64_t utime = 0;
    Bytes bytes;  // until the next Read
  };

  // `url` is a valid udpm:// URL. Datagrams of other groups on its port are not received. At most kMaxPerRead
  // datagrams are read at once, each with 64 KiB of room, which costs memory only as far as datagrams have filled it.
  explicit MulticastPort(const LcmUrl& url);
  ~MulticastPort();
  MulticastPort(MulticastPort&&) noexcept;
  MulticastPort& operator=(MulticastPort&&) noexcept;

  // The cause and the remedy if the port does not work. Empty: it works.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  // Returns a text if the buffer is smaller than requested, with the commands that fix it; otherwise empty.
  [[nodiscard]] const std::string& warning() const { return warning_; }
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }  // readable when datagrams wait

  // Returns the waiting datagrams, at most kMaxPerRead. Does not wait, and allocates nothing. With ttl=0, a datagram of another
  // host is empty.
  [[nodiscard]] std::span<const Received> Read();

  // Datagrams that the kernel has dropped at this socket, up to now: because its buffer was full, or because they were damaged.
  [[nodiscard]] std::int64_t Dropped();
  // Datagrams of other hosts that were refused because of ttl=0, and empty ones.
  [[nodiscard]] std::int64_t outside() const { return outside_; }

 private:
  struct Buffers;

  void SetBuffer(std::int64_t bytes);

  Descriptor socket_;
  std::unique_ptr<Buffers> buffers_;
  std::uint32_t drop_counter_ = 0;  // of the kernel; wraps around
  std::int64_t dropped_ = 0;
  bool own_host_only_;
  std::int64_t outside_ = 0;
  std::string problem_;
  std::string warning_;
};

// Sends a datagram to the URL's group and port and waits up to 1 s until it arrives here. The error contains the cause and the
// commands that fix it. `axlecast up` checks this before it starts anything.
[[nodiscard]] Result<> CheckMulticast(const std::string& url);

}  // namespace axlecast
