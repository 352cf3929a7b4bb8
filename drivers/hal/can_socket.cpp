#include "drivers/hal/can_socket.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/errqueue.h>
#include <linux/net_tstamp.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

#include "drivers/hal/line_guard.h"

namespace axlecast {
namespace {

// If reading the two clocks took longer, it was interrupted, and is repeated a few times.
constexpr MonoNs kNarrow = 5 * kMicrosecond;
constexpr int kTries = 4;

constexpr std::size_t kControllerStatus = 1;
constexpr std::size_t kProtocolType = 2;
constexpr std::size_t kProtocolLocation = 3;
constexpr std::size_t kTransmitErrors = 6;
constexpr std::size_t kReceiveErrors = 7;

constexpr unsigned kErrorTypes = CAN_ERR_PROT_BIT | CAN_ERR_PROT_FORM | CAN_ERR_PROT_STUFF | CAN_ERR_PROT_BIT0 |
                                 CAN_ERR_PROT_BIT1 | CAN_ERR_PROT_OVERLOAD;

// Many drivers (sja1000, m_can, c_can) report a missing acknowledge only as the location of a protocol error.
bool Unacknowledged(std::uint32_t classes, unsigned type, unsigned location) {
  if ((classes & CAN_ERR_ACK) != 0) return true;
  return (classes & CAN_ERR_PROT) != 0 && location == CAN_ERR_PROT_LOC_ACK && (type & kErrorTypes) == 0;
}

// A buffer was full. Some drivers (slcan) also set the class of bus errors in such a frame, without an error.
bool OnlyOverflow(unsigned status, unsigned type, unsigned location) {
  return (status & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW)) != 0 && type == 0 && location == 0;
}

static_assert(kCanExtended == CAN_EFF_FLAG && kCanRemote == CAN_RTR_FLAG && kCanError == CAN_ERR_FLAG);
static_assert(kMaxCanData == CAN_MAX_DLEN);

constexpr std::int64_t kTopBitrate = 1'000'000;
// The shortest frame, without data and stuff bits, and the gap behind it (ISO 11898-1).
constexpr std::int64_t kShortestFrame = 47;
// What the kernel charges a socket for one received frame (skb truesize on 64 bits).
constexpr std::int64_t kFrameCost = 768;
// A driver that is busy for this time must not lose frames of a full bus.
constexpr std::int64_t kMinRoomMs = 100;
// The bit rates of a bus's nodes may differ by some 0.5 %.
constexpr std::int64_t kBitrateShare = 200;

template <typename T>
bool SetOption(int fd, int level, int name, const T& value) {
  return setsockopt(fd, level, name, &value, sizeof value) == 0;
}

Error SocketError(int error) {
  switch (error) {
    case EAFNOSUPPORT:
      return {
          "this kernel has no CAN: as root: modprobe can-raw (or let this program use AF_CAN: systemd, "
          "RestrictAddressFamilies); without hardware: simulate: true"};
    case EPROTONOSUPPORT:
      return {"this kernel has no raw CAN sockets: as root: modprobe can-raw"};
    default:
      return {std::string("no CAN socket can be made: ") + std::strerror(error)};
  }
}

Error NoSuchInterface(const std::string& name) {
  if (name.rfind("vcan", 0) == 0) {
    return {name + " does not exist; as root: modprobe vcan; ip link add " + name + " type vcan; ip link set " +
            name + " up"};
  }
  return {
      name +
      " does not exist: plug the adapter in, load its module (gs_usb, peak_usb, mcp251x, ...: dmesg), or correct "
      "link.iface; `ip link show type can` lists them"};
}

can_frame ToKernel(const CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.id;
  raw.len = static_cast<std::uint8_t>(frame.data.size());
  std::copy_n(frame.data.data(), frame.data.size(), raw.data);
  return raw;
}

CanFrame FromKernel(const can_frame& raw) {
  CanFrame frame;
  frame.id = raw.can_id;
  const bool has_data = (raw.can_id & kCanRemote) == 0 || (raw.can_id & kCanError) != 0;
  if (has_data) frame.data.Append(Bytes(raw.data, std::min<std::size_t>(raw.len, CAN_MAX_DLEN)));
  return frame;
}

// Kernel filters: the error bit means "inverted" there.
can_filter ToKernel(const CanFilter& filter) { return {filter.id & ~kCanError, filter.mask & ~kCanError}; }

can_filter Exactly(std::uint32_t id) {
  const std::uint32_t bits = (id & kCanExtended) != 0 ? kCanExtendedMask : kCanStandardMask;
  return {id, CAN_EFF_FLAG | CAN_RTR_FLAG | bits};
}

// What recvmsg returns in addition to a frame.
struct Extras {
  std::optional<std::int64_t> stamp;   // ns UNIX
  std::optional<std::uint32_t> drops;  // since the socket was made
};

Extras ReadExtras(msghdr& message) {
  Extras extras;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET) continue;
    if (part->cmsg_type == SCM_TIMESTAMPING) {
      scm_timestamping stamps{};
      std::memcpy(&stamps, CMSG_DATA(part), sizeof stamps);
      const auto& software = stamps.ts[0];
      if (software.tv_sec != 0) extras.stamp = software.tv_sec * kSecond + software.tv_nsec;
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t drops = 0;
      std::memcpy(&drops, CMSG_DATA(part), sizeof drops);
      extras.drops = drops;
    }
  }
  return extras;
}

}  // namespace

CanArrival::Offset CanArrival::Read() const {
  Offset best;
  for (int i = 0; i < kTries; ++i) {
    const MonoNs first = clock_.Now();
    const std::int64_t unix_us = clock_.UtcMicroseconds();  // rounded down
    const MonoNs last = clock_.Now();
    const Offset offset{.minimum = unix_us * kMicrosecond - last,
                        .maximum = unix_us * kMicrosecond + kMicrosecond - first,
                        .now = last};
    if (i == 0 || offset.maximum - offset.minimum < best.maximum - best.minimum) best = offset;
    best.now = last;
    if (best.maximum - best.minimum <= kNarrow) break;
  }
  return best;
}

void CanArrival::Start() {
  before_ = Read();
  floor_ = empty_ = before_.now;
}

Interval CanArrival::At(std::optional<std::int64_t> stamp) {
  const Offset offset = Read();
  const bool stepped = offset.minimum > before_.maximum || offset.maximum < before_.minimum;
  before_ = offset;
  const Interval unstamped{std::max(floor_, empty_), offset.now};
  if (!stamp || stepped) return unstamped;
  const Interval at{*stamp - offset.maximum, *stamp - offset.minimum};
  // Outside: the clock was stepped after the timestamp, and stepped back.
  if (at.last < floor_ || at.first > offset.now) return unstamped;
  floor_ = std::max(at.first, floor_);
  return {floor_, std::min(at.last, offset.now)};
}

void CountCanError(const CanFrame& frame, CanController& controller) {
  if ((frame.id & kCanError) == 0) return;
  const std::uint32_t classes = frame.id & kCanExtendedMask;
  const auto data = [&](std::size_t i) { return i < frame.data.size() ? unsigned{frame.data.data()[i]} : 0U; };

  const unsigned status = (classes & CAN_ERR_CRTL) != 0 ? data(kControllerStatus) : 0;
  if ((classes & CAN_ERR_BUSOFF) != 0) ++controller.bus_offs;
  if ((classes & CAN_ERR_RESTARTED) != 0) ++controller.restarts;
  if (Unacknowledged(classes, data(kProtocolType), data(kProtocolLocation))) {
    ++controller.unacknowledged;
  } else if ((classes & (CAN_ERR_PROT | CAN_ERR_BUSERROR)) != 0 &&
             !OnlyOverflow(status, data(kProtocolType), data(kProtocolLocation))) {
    ++controller.bus_errors;
  }
  if ((status & CAN_ERR_CRTL_RX_OVERFLOW) != 0) ++controller.overruns;
  if ((status & CAN_ERR_CRTL_TX_OVERFLOW) != 0) ++controller.queue_full;
  if ((classes & CAN_ERR_CNT) != 0 && frame.data.size() == CAN_ERR_DLC) {
    controller.tec = static_cast<int>(data(kTransmitErrors));
    controller.rec = static_cast<int>(data(kReceiveErrors));
  }
}

CanSocket::CanSocket(CanSettings settings, const Clock& clock)
    : settings_(std::move(settings)), waiter_(clock), arrival_(clock) {
  own_ids_.reserve(CAN_RAW_FILTER_MAX);
}

Result<> CanSocket::Open() {
  Close();
  Result<> opened = SetUp();
  if (opened) {
    waiter_.Attach(socket_.get());
    arrival_.Start();
  } else {
    Close();
  }
  return opened;
}

void CanSocket::Close() {
  waiter_.Detach();
  socket_.Reset();
  lock_.Reset();
  netlink_.Close();
}

Result<> CanSocket::SetUp() {
  warnings_.clear();
  own_ids_.clear();
  counts_ = {};
  drops_seen_ = 0;
  if (Result<> ready = waiter_.CheckReady(); !ready) return ready;
  socket_ = Descriptor(socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!socket_.valid()) return Failure(SocketError(errno));
  if (Result<> opened = netlink_.Open(); !opened) return opened;
  const CanInterfaceReply interface = netlink_.Ask(settings_.interface);
  if (!interface) {
    if (interface.error() == ENODEV) return Failure(NoSuchInterface(settings_.interface));
    return Failure(settings_.interface + ": the kernel does not describe it: " + std::strerror(interface.error()));
  }
  Result<> ready =
      CheckInterface(*interface).and_then([&] { return Claim(); }).and_then([&] { return Configure(); });
  if (!ready) return ready;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = interface->index;
  if (bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return {};
  return Failure(settings_.interface + ": " + std::strerror(errno));
}

Result<> CanSocket::CheckInterface(const CanInterface& interface) {
  const std::string& name = settings_.interface;
  const std::string again = "; as root: " + CanAgainLine(name, settings_.bitrate, interface.restarts);
  if (!interface.is_can)
    return Failure(name + " is no CAN interface: correct link.iface; `ip link show type can` lists them");
  if (!interface.up) {
    return Failure(name + " is down; as root: " +
                   (interface.is_controller ? CanUpLine(name, settings_.bitrate, interface.restarts)
                                            : "ip link set " + name + " up"));
  }
  if (settings_.bitrate > 0 && interface.bitrate > 0 &&
      std::abs(interface.bitrate - settings_.bitrate) > settings_.bitrate / kBitrateShare) {
    return Failure(name + " is at " + std::to_string(interface.bitrate) + " bit/s" + again);
  }
  if (interface.loopback)
    return Failure(name + " receives only its own frames (loopback)" + again + " loopback off");
  if (interface.listen_only)
    warnings_.push_back(name + " sends and acknowledges nothing" + again + " listen-only off");
  if (interface.presume_ack)
    warnings_.push_back(name + " confirms what no node has read" + again + " presume-ack off");
  if (interface.restarts && interface.restart_ms == 0) {
    warnings_.push_back("after a bus-off " + name + " stays off" + again);
  }
  one_shot_ = interface.one_shot;
  return {};
}

// An abstract name belongs to a network namespace, like an interface, and ends with the process.
Result<> CanSocket::Claim() {
  if (!settings_.sole) return {};
  const std::string name = CanLockName(settings_.interface);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  name.copy(&address.sun_path[1], sizeof address.sun_path - 1);
  lock_ = Descriptor(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (lock_.valid() && bind(lock_.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0) return {};
  if (errno == EADDRINUSE) return Failure(settings_.interface + ": " + std::string(kLineHeld));
  return Failure(settings_.interface + " cannot be locked: " + std::strerror(errno));
}

Result<> CanSocket::Configure() {
  const int fd = socket_.get();
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  const int on = 1;
  const int stamps = SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  const bool set = ApplyFilters() && SetOption(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, all_errors) &&
                   SetOption(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, on) &&
                   SetOption(fd, SOL_SOCKET, SO_TIMESTAMPING, stamps) && SetOption(fd, SOL_SOCKET, SO_RXQ_OVFL, on);
  if (!set) return Failure(settings_.interface + " refuses its settings: " + std::strerror(errno));
  MakeRoom();
  return {};
}

// Room for a second of the shortest frames.
void CanSocket::MakeRoom() {
  const std::int64_t bitrate = settings_.bitrate > 0 ? settings_.bitrate : kTopBitrate;
  const std::int64_t second = bitrate / kShortestFrame * kFrameCost;
  // The kernel doubles the value. FORCE requires a privilege; without it, net.core.rmem_max limits the size.
  const int half = static_cast<int>(second / 2);
  if (!SetOption(socket_.get(), SOL_SOCKET, SO_RCVBUFFORCE, half)) {
    static_cast<void>(SetOption(socket_.get(), SOL_SOCKET, SO_RCVBUF, half));
  }
  int room = 0;
  socklen_t size = sizeof room;
  if (getsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &room, &size) != 0) return;
  const std::int64_t room_ms = room * std::int64_t{1'000} / second;
  if (room_ms >= kMinRoomMs) return;
  warnings_.push_back(settings_.interface + ": room for only " + std::to_string(room_ms) +
                      " ms of a full bus; as root: sysctl -w net.core.rmem_max=" + std::to_string(half));
}

bool CanSocket::ApplyFilters() {
  std::array<can_filter, CAN_RAW_FILTER_MAX> filters{};
  const std::size_t count = settings_.filters.size() + own_ids_.size();
  // Without filters, or with too many, the kernel passes all frames, and IsSelected selects.
  if (settings_.filters.empty() || count > filters.size()) {
    return setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), sizeof filters[0]) == 0;
  }
  auto next = std::transform(settings_.filters.begin(), settings_.filters.end(), filters.begin(),
                             [](const CanFilter& filter) { return ToKernel(filter); });
  std::transform(own_ids_.begin(), own_ids_.end(), next, Exactly);
  return setsockopt(socket_.get(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                    static_cast<socklen_t>(count * sizeof filters[0])) == 0;
}

// Own frames pass the same filters. Returns false if the kernel does not accept the filters.
bool CanSocket::ReceiveOwn(std::uint32_t id) {
  if (IsSelected(id) || own_ids_.size() == own_ids_.capacity()) return true;
  if (std::find(own_ids_.begin(), own_ids_.end(), id) != own_ids_.end()) return true;
  own_ids_.push_back(id);
  return ApplyFilters();
}

bool CanSocket::IsSelected(std::uint32_t id) const {
  return settings_.filters.empty() || std::any_of(settings_.filters.begin(), settings_.filters.end(),
                                                  [id](const CanFilter& filter) { return Passes(filter, id); });
}

FrameLink::SendResult CanSocket::Send(const CanFrame& frame) {
  if (!IsOpen() || !ReceiveOwn(frame.id)) return SendResult::kLost;
  const can_frame raw = ToKernel(frame);
  while (write(socket_.get(), &raw, sizeof raw) < 0) {
    if (errno == EINTR) continue;
    if (errno != ENOBUFS && errno != EAGAIN) return SendResult::kLost;
    ++counts_.queue_full;
    return SendResult::kFull;
  }
  ++counts_.pending;
  return SendResult::kQueued;
}

FrameLink::Status CanSocket::Receive(Received& received) {
  if (!IsOpen()) return Status::kLost;
  can_frame raw{};
  iovec into{&raw, sizeof raw};
  alignas(cmsghdr) std::array<char, 256> control;
  while (true) {
    msghdr message{};
    message.msg_iov = &into;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = recvmsg(socket_.get(), &message, 0);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) {
      arrival_.Empty();
      return Status::kTimeout;
    }
    if (size < 0) return Status::kLost;
    const Extras extras = ReadExtras(message);
    if (extras.drops) counts_.dropped += *extras.drops - std::exchange(drops_seen_, *extras.drops);
    if (size != sizeof raw) continue;  // CAN FD is not enabled
    received = {
        .frame = FromKernel(raw), .at = arrival_.At(extras.stamp), .own = (message.msg_flags & MSG_CONFIRM) != 0};
    Account(received);
    if (received.own || (raw.can_id & kCanError) != 0 || IsSelected(raw.can_id)) return Status::kOk;
  }
}

void CanSocket::Account(const Received& received) {
  if (received.own && counts_.pending > 0) --counts_.pending;
  const std::int64_t bus_offs = counts_.bus_offs;
  CountCanError(received.frame, counts_);
  if (counts_.bus_offs > bus_offs) counts_.pending = 0;  // the kernel has dropped them
}

CanController CanSocket::Controller() {
  if (!IsOpen()) return {};
  CanController controller = counts_;
  if (one_shot_) controller.pending = 0;
  const CanInterfaceReply interface = netlink_.Ask(settings_.interface);
  if (!interface) return controller;
  controller.state = interface->state;
  if (interface->tec >= 0) controller.tec = interface->tec;
  if (interface->rec >= 0) controller.rec = interface->rec;
  controller.bitrate = interface->bitrate;
  controller.restart_ms = interface->restart_ms;
  return controller;
}

}  // namespace axlecast
