#pragma once

#include <cstdint>
#include <optional>

#include "core/time/chrony_packet.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Asks chronyd of this host what it states about UNIX time, on UDP 127.0.0.1:323. Never waits: the reply is received later. Used by one
// thread.
class ChronyPort {
 public:
  ChronyPort();

  // Sends a request. Without chronyd, no reply follows.
  void Ask();
  // Returns the reply to the last request if it has arrived. Other datagrams are dropped.
  [[nodiscard]] std::optional<ChronyTracking> Receive();
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }  // readable when Receive has work

 private:
  Descriptor socket_;
  std::uint32_t sequence_ = 0;
};

}  // namespace axlecast
