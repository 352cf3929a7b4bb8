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
  bool is_can = false;         // else Ethernet or another kind
  bool up = false;             // IFF_UP
  bool is_controller = false;  // it has a bit rate and a state; vcan has not
  CanController::State state = CanController::State::kUnknown;
  int tec = -1;
  int rec = -1;
  std::int64_t bitrate = 0;  // bit/s, as the controller divides its clock; 0: not set or unknown
  std::int64_t restart_ms = 0;
  bool restarts = false;     // restart-ms works; not with adapters on serial lines
  bool listen_only = false;  // sends and acknowledges nothing
  bool loopback = false;     // receives only its own frames
  bool one_shot = false;     // tries each frame once
  bool presume_ack = false;  // regards every frame as acknowledged
};

// The kernel's answer: the interface, or the errno of its refusal.
using CanInterfaceReply = tl::expected<CanInterface, int>;

// Parses a reply of the kernel. EBADMSG: it is not a reply to a query about one interface.
[[nodiscard]] CanInterfaceReply ParseCanInterface(Bytes reply);

// Queries the kernel about interfaces, without privileges. Each query takes about 10 us, and more while an interface is being
// changed. Allocates nothing.
class CanNetlink {
 public:
  // Must succeed before any other call. The error contains the cause and the remedy.
  [[nodiscard]] Result<> Open();
  void Close() { socket_.Reset(); }

  // ENODEV: the interface does not exist.
  [[nodiscard]] CanInterfaceReply Ask(const std::string& interface);

  // Changes a CAN controller that is down, or switches it up or down. Requires CAP_NET_ADMIN. Returns 0 or the errno: EPERM,
  // EBUSY (it is up), EINVAL (unsupported bit rate), EOPNOTSUPP (it cannot listen only). `bitrate` 0: unchanged.
  [[nodiscard]] int Configure(const CanInterface& interface, std::int64_t bitrate, bool listen_only);
  [[nodiscard]] int Switch(const CanInterface& interface, bool up);

 private:
  // Sends a request. Returns the reply, which is valid until the next call, or the errno.
  [[nodiscard]] tl::expected<Bytes, int> Exchange(Bytes request);
  [[nodiscard]] int Change(Bytes request);

  Descriptor socket_;
  std::uint32_t sequence_ = 0;
  alignas(8) std::array<std::uint8_t, 16'384> reply_{};  // about 2 kB for one interface
};

}  // namespace axlecast
