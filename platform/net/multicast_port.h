#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/lcm_url.h"
#include "platform/net/group_socket.h"
#include "platform/net/network_interface.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {

// The only place that receives the datagrams of LCM, with their senders, the timestamps of the kernel, and the count of datagrams
// that the kernel dropped. It receives only what was sent to the group, never a datagram to the address of this host. With ttl=0,
// it receives only what this host sent. The kernel determines this (a looped-back copy, or a datagram from lo), not the address
// of the sender, which can be forged. It sends nothing. Used by one thread.
//
// If the URL names an interface, it receives by this interface only. The interface may be missing at the start, go down, and be
// deleted and made again: the port receives again within 1 s of its return, if Read is called while FileDescriptor is readable.
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
  // Returns why nothing is received by the interface of the URL at present; empty: it can be used, or the URL names none.
  [[nodiscard]] const std::string& network_problem() const { return network_problem_; }
  // Readable when datagrams wait. With an interface also twice a second, so that Read looks at the interface.
  [[nodiscard]] int FileDescriptor() const { return watch_ ? wake_.get() : socket_.get(); }

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
  // Opens what wakes the user of the port to look at the interface. Returns false with errno set.
  bool OpenTimer();
  void Follow();

  GroupAddress group_;
  SystemClock clock_;
  Descriptor socket_;
  Descriptor timer_;
  Descriptor wake_;  // readable if socket_ or timer_ is
  std::optional<InterfaceWatch> watch_;
  unsigned joined_ = 0;  // interface
  MonoNs next_look_ = 0;
  std::string network_problem_;
  std::unique_ptr<Buffers> buffers_;
  std::uint32_t drop_counter_ = 0;  // of the kernel; wraps around
  std::int64_t dropped_ = 0;
  bool own_host_only_;
  std::int64_t outside_ = 0;
  std::string problem_;
  std::string warning_;
};

}  // namespace axlecast
