#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/messages/lcm_url.h"
#include "platform/net/group_socket.h"
#include "platform/net/network_interface.h"
#include "platform/os/descriptor.h"
#include "platform/os/system_clock.h"

namespace axlecast {

// Sends messages to a udpm:// URL in LCM's datagrams (udpm_receiver.h), as liblcm does, and by the interface of the URL, which liblcm
// cannot select. If the interface is missing, nothing is sent, also not by another interface. Thread-safe.
class GroupSender {
 public:
  // `url` is a valid udpm:// URL.
  explicit GroupSender(const LcmUrl& url);

  // Sends a message. `channel` has 1 to kLongestChannel bytes. Returns false if it could not be sent. May wait until the kernel has
  // room for it.
  [[nodiscard]] bool Send(std::string_view channel, Bytes message);

  // Fails with the reason if messages cannot be sent, or do not reach other hosts, as far as the interface and the messages of the last
  // 2 s show.
  [[nodiscard]] Result<> Check();

 private:
  // Returns false if the URL names an interface that does not exist.
  bool Follow();
  bool SendShort(std::string_view channel, Bytes message);
  bool SendFragments(std::string_view channel, Bytes message);
  bool SendDatagram(Bytes head, Bytes part);

  const GroupAddress group_;
  const std::string group_text_;
  const SystemClock clock_;
  std::mutex mutex_;  // of what follows: all fragments of a message are sent together
  Descriptor socket_;
  std::optional<InterfaceWatch> watch_;
  unsigned outgoing_ = 0;
  MonoNs next_look_ = 0;
  std::uint32_t sequence_ = 0;
  int send_error_ = 0;  // errno of the last datagram; 0: it was sent
  MonoNs failed_ = 0;   // instant of send_error_
};

}  // namespace axlecast
