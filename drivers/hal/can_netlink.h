#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/base/inline_bytes.h"
#include "core/base/result.h"
#include "core/device/can.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A network interface as the kernel describes it (rtnetlink(7), linux/can/netlink.h).
struct CanInterface {
  int index = 0;
  bool is_can = false;         // else Ethernet or whatever
  bool up = false;             // IFF_UP
  bool is_controller = false;  // it has CAN settings: bit rate, state; vcan has none
  CanController::State state = CanController::State::kUnknown;
  int tec = -1;
  int rec = -1;
  std::int64_t bitrate = 0;  // bit/s, as the controller divides its clock; 0 not set or not told
  std::int64_t restart_ms = 0;
  bool restarts = false;     // restart-ms works: it hangs on a bus of the machine; adapters on serial lines cannot
  bool listen_only = false;  // sends and acknowledges nothing
  bool loopback = false;     // receives only its own frames
  bool one_shot = false;     // tries each frame once
  bool presume_ack = false;  // takes every frame for acknowledged
};

// The kernel's answer: the interface, or the errno of its refusal.
using CanInterfaceReply = tl::expected<CanInterface, int>;

// Pure. EBADMSG for what is no reply to a question about one interface.
[[nodiscard]] CanInterfaceReply ParseCanInterface(Bytes reply);

// Asks the kernel about interfaces; needs no rights. Each question costs some 10 us, more while somebody else is
// just changing an interface.
class CanNetlink {
 public:
  // Must succeed before any other call. The error contains the cause and the remedy.
  [[nodiscard]] Result<> Open();
  void Close() { socket_.Reset(); }

  // ENODEV: there is no such interface.
  [[nodiscard]] CanInterfaceReply Ask(const std::string& interface);

  // Changes a CAN controller that is down, or switches it; takes CAP_NET_ADMIN. 0, or the errno: EPERM, EBUSY (it is
  // up), EINVAL (no such bit rate), EOPNOTSUPP (it cannot listen only). `bitrate` 0 leaves that as it is.
  [[nodiscard]] int Configure(const CanInterface& interface, std::int64_t bitrate, bool listen_only);
  [[nodiscard]] int Switch(const CanInterface& interface, bool up);

 private:
  [[nodiscard]] int Send(const std::string& interface);
  [[nodiscard]] int SendBytes(const void* bytes, std::size_t size);
  // The next message that answers the last question; an errno.
  [[nodiscard]] tl::expected<Bytes, int> Receive();
  [[nodiscard]] int Do(Bytes order);

  Descriptor socket_;
  std::uint32_t sequence_ = 0;
  alignas(8) std::array<std::uint8_t, 16'384> reply_{};  // one interface takes some 2 kB
};

}  // namespace axlecast
