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

// The only place that receives LCM's datagrams: with their senders and the kernel's times, and with what the kernel
// dropped. It takes only what was sent to the group, never a datagram to this host's own address. With ttl=0 it takes only
// what this host sent: the kernel itself reports it (a looped-back copy, or a datagram from lo), not the sender's
// address, which can be forged. Read-only: it sends nothing. One thread.
class MulticastPort {
 public:
  static constexpr std::size_t kMaxPerRead = 16;  // 1 MiB of room: a flood of the longest ones cannot touch more
  static constexpr std::int64_t kDefaultBuffer = 32 << 20;  // bytes, unless the URL has recv_buf_size

  struct Received {
    SenderAddress sender;
    // us, UNIX time at which the kernel received it. Where no other socket of the host asks for such times, the kernel
    // begins with them a moment after the port was opened; what came before bears the time at which it was read.
    std::int64_t utime = 0;
    Bytes bytes;  // until the next Read
  };

  // `url` is a good udpm:// URL. Datagrams of other groups on its port are not received. At most kMaxPerRead
  // datagrams are read at once, each with 64 KiB of room, which costs memory only as far as datagrams have filled it.
  explicit MulticastPort(const LcmUrl& url);
  ~MulticastPort();
  MulticastPort(MulticastPort&&) noexcept;
  MulticastPort& operator=(MulticastPort&&) noexcept;

  // Empty when the port works, else the cause and the remedy.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  // Returns a text if the buffer is smaller than requested, with the commands that fix it; otherwise empty.
  [[nodiscard]] const std::string& warning() const { return warning_; }
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }  // readable when datagrams wait

  // The datagrams that wait, at most kMaxPerRead; does not wait, allocates nothing. One that
  // another host sent although ttl=0 is empty.
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
  std::uint32_t drop_counter_ = 0;  // the kernel's, which wraps around
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
