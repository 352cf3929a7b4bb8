#include "drivers/hal/can_netlink.h"

#include <linux/can/netlink.h>
#include <linux/if.h>
#include <linux/if_arp.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

namespace axlecast {
namespace {

// libnl-route-3 does not replace this code: it allocates an object for each query, which a bus thread must not do, and it does
// not read IFLA_PARENT_DEV_NAME.

// Returns the structure at the begin of `bytes`; zeros if there are too few bytes.
template <typename T>
T Load(Bytes bytes) {
  T value{};
  if (bytes.size() >= sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

constexpr unsigned kTypeMask = 0x3FFF;  // NLA_TYPE_MASK

constexpr std::size_t Aligned(std::size_t size) { return (size + 3) & ~std::size_t{3}; }

// Calls handle(type, value) for each attribute in `bytes`. Ends at the first one that does not fit.
template <typename Handle>
void ForEachAttribute(Bytes bytes, Handle handle) {
  while (bytes.size() >= sizeof(rtattr)) {
    const auto header = Load<rtattr>(bytes);
    if (header.rta_len < sizeof(rtattr) || header.rta_len > bytes.size()) return;
    handle(header.rta_type & kTypeMask, bytes.first(header.rta_len).subspan(sizeof(rtattr)));
    bytes = bytes.subspan(std::min(Aligned(header.rta_len), bytes.size()));
  }
}

CanController::State StateOf(std::uint32_t state) {
  using State = CanController::State;
  switch (state) {
    case CAN_STATE_ERROR_ACTIVE:
      return State::kActive;
    case CAN_STATE_ERROR_WARNING:
      return State::kWarning;
    case CAN_STATE_ERROR_PASSIVE:
      return State::kPassive;
    case CAN_STATE_BUS_OFF:
      return State::kBusOff;
    case CAN_STATE_STOPPED:
    case CAN_STATE_SLEEPING:
      return State::kStopped;
    default:
      return State::kUnknown;
  }
}

void ReadMode(std::uint32_t flags, CanInterface& interface) {
  interface.listen_only = (flags & CAN_CTRLMODE_LISTENONLY) != 0;
  interface.loopback = (flags & CAN_CTRLMODE_LOOPBACK) != 0;
  interface.one_shot = (flags & CAN_CTRLMODE_ONE_SHOT) != 0;
  interface.presume_ack = (flags & CAN_CTRLMODE_PRESUME_ACK) != 0;
}

void ReadCanAttribute(unsigned type, Bytes value, CanInterface& interface) {
  switch (type) {
    case IFLA_CAN_BITTIMING:
      interface.bitrate = Load<can_bittiming>(value).bitrate;
      break;
    case IFLA_CAN_STATE:
      if (value.size() >= sizeof(std::uint32_t)) interface.state = StateOf(Load<std::uint32_t>(value));
      break;
    case IFLA_CAN_RESTART_MS:
      interface.restart_ms = Load<std::uint32_t>(value);
      break;
    case IFLA_CAN_BERR_COUNTER:
      if (value.size() < sizeof(can_berr_counter)) break;
      interface.tec = Load<can_berr_counter>(value).txerr;
      interface.rec = Load<can_berr_counter>(value).rxerr;
      break;
    case IFLA_CAN_CTRLMODE:
      ReadMode(Load<can_ctrlmode>(value).flags, interface);
      break;
    default:
      break;
  }
}

bool IsCan(Bytes kind) {
  const std::string_view text(reinterpret_cast<const char*>(kind.data()), kind.size());
  return text.substr(0, text.find('\0')) == "can";
}

void ReadLinkInfo(Bytes info, CanInterface& interface) {
  Bytes data;
  ForEachAttribute(info, [&](unsigned type, Bytes value) {
    if (type == IFLA_INFO_KIND) interface.is_controller = IsCan(value);
    if (type == IFLA_INFO_DATA) data = value;
  });
  // The data of another kind (vxcan, a bridge) has other attributes.
  if (!interface.is_controller) return;
  ForEachAttribute(data, [&](unsigned type, Bytes value) { ReadCanAttribute(type, value, interface); });
}

// Composes a request about an interface, attribute by attribute.
class Request {
 public:
  // `flags`: of nlmsghdr, in addition to NLM_F_REQUEST.
  Request(std::uint16_t type, unsigned flags, int index) {
    header_.nlmsg_type = type;
    header_.nlmsg_flags = static_cast<std::uint16_t>(NLM_F_REQUEST | flags);
    info_.ifi_index = index;
  }

  void SetFlags(unsigned flags, unsigned mask) {
    info_.ifi_flags = flags;
    info_.ifi_change = mask;
  }
  void Put(unsigned type, const void* value, std::size_t size) {
    const std::size_t at = Begin(type);
    Append(value, size);
    End(at);
  }
  // Begins an attribute that contains the attributes that follow, until End.
  [[nodiscard]] std::size_t Begin(unsigned type) {
    const std::size_t at = size_;
    const rtattr header{.rta_len = 0, .rta_type = static_cast<std::uint16_t>(type)};
    Append(&header, sizeof header);
    return at;
  }
  void End(std::size_t at) {
    const auto size = static_cast<std::uint16_t>(size_ - at);
    std::memcpy(&bytes_[at], &size, sizeof size);  // rta_len
    size_ = Aligned(size_);
  }

  [[nodiscard]] Bytes Finish(std::uint32_t sequence) {
    header_.nlmsg_len = static_cast<std::uint32_t>(size_);
    header_.nlmsg_seq = sequence;
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    std::memcpy(&bytes_[sizeof header_], &info_, sizeof info_);
    return Bytes(bytes_).first(size_);
  }

 private:
  void Append(const void* value, std::size_t size) {
    std::memcpy(&bytes_[size_], value, size);
    size_ += size;
  }

  nlmsghdr header_{};
  ifinfomsg info_{};
  std::array<std::uint8_t, 256> bytes_{};
  std::size_t size_ = sizeof header_ + sizeof info_;
};

}  // namespace

CanInterfaceReply ParseCanInterface(Bytes reply) {
  const auto header = Load<nlmsghdr>(reply);
  if (header.nlmsg_len < sizeof header || header.nlmsg_len > reply.size()) return tl::unexpected(EBADMSG);
  const Bytes body = reply.first(header.nlmsg_len).subspan(sizeof header);
  if (header.nlmsg_type == NLMSG_ERROR && body.size() >= sizeof(nlmsgerr)) {
    const int error = -Load<nlmsgerr>(body).error;
    return tl::unexpected(error > 0 ? error : EBADMSG);
  }
  if (header.nlmsg_type != RTM_NEWLINK || body.size() < sizeof(ifinfomsg)) return tl::unexpected(EBADMSG);
  const auto info = Load<ifinfomsg>(body);
  CanInterface interface;
  interface.index = info.ifi_index;
  interface.is_can = info.ifi_type == ARPHRD_CAN;
  interface.up = (info.ifi_flags & IFF_UP) != 0;
  ForEachAttribute(body.subspan(sizeof info), [&](unsigned type, Bytes value) {
    if (type == IFLA_LINKINFO) ReadLinkInfo(value, interface);
    if (type == IFLA_PARENT_DEV_NAME) interface.restarts = true;
  });
  if (!interface.up) interface.state = CanController::State::kStopped;
  return interface;
}

Result<> CanNetlink::Open() {
  socket_ = Descriptor(socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE));
  if (socket_.valid()) return {};
  return Failure(std::string("the kernel cannot be asked about CAN interfaces: ") + std::strerror(errno) +
                 "; let this program use AF_NETLINK (systemd: RestrictAddressFamilies)");
}

tl::expected<Bytes, int> CanNetlink::Exchange(Bytes request) {
  sockaddr_nl kernel{};
  kernel.nl_family = AF_NETLINK;
  if (sendto(socket_.get(), request.data(), request.size(), 0, reinterpret_cast<const sockaddr*>(&kernel),
             sizeof kernel) < 0) {
    return tl::unexpected(errno);
  }
  // The kernel answers before sendto returns.
  while (true) {
    const ssize_t size = recv(socket_.get(), reply_.data(), reply_.size(), MSG_DONTWAIT | MSG_TRUNC);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return tl::unexpected(errno);
    if (static_cast<std::size_t>(size) > reply_.size()) return tl::unexpected(EMSGSIZE);
    const Bytes reply(reply_.data(), static_cast<std::size_t>(size));
    if (Load<nlmsghdr>(reply).nlmsg_seq == sequence_) return reply;
  }
}

CanInterfaceReply CanNetlink::Ask(const std::string& interface) {
  if (interface.empty() || interface.size() >= IFNAMSIZ) return tl::unexpected(ENODEV);
  constexpr std::uint32_t kMask = RTEXT_FILTER_SKIP_STATS;
  Request request(RTM_GETLINK, 0, 0);
  request.Put(IFLA_IFNAME, interface.c_str(), interface.size() + 1);
  request.Put(IFLA_EXT_MASK, &kMask, sizeof kMask);
  return Exchange(request.Finish(++sequence_)).and_then(ParseCanInterface);
}

// ---- changes ----

int CanNetlink::Configure(const CanInterface& interface, std::int64_t bitrate, bool listen_only) {
  can_ctrlmode mode{};
  mode.mask = CAN_CTRLMODE_LISTENONLY;
  mode.flags = listen_only ? CAN_CTRLMODE_LISTENONLY : 0;
  can_bittiming timing{};  // the kernel computes the other fields
  timing.bitrate = static_cast<std::uint32_t>(bitrate);
  Request request(RTM_NEWLINK, NLM_F_ACK, interface.index);
  const std::size_t info = request.Begin(IFLA_LINKINFO);
  request.Put(IFLA_INFO_KIND, "can", 3);
  const std::size_t data = request.Begin(IFLA_INFO_DATA);
  request.Put(IFLA_CAN_CTRLMODE, &mode, sizeof mode);
  if (bitrate > 0) request.Put(IFLA_CAN_BITTIMING, &timing, sizeof timing);
  request.End(data);
  request.End(info);
  return Change(request.Finish(++sequence_));
}

int CanNetlink::Switch(const CanInterface& interface, bool up) {
  Request request(RTM_NEWLINK, NLM_F_ACK, interface.index);
  request.SetFlags(up ? IFF_UP : 0, IFF_UP);
  return Change(request.Finish(++sequence_));
}

int CanNetlink::Change(Bytes request) {
  const tl::expected<Bytes, int> reply = Exchange(request);
  if (!reply) return reply.error();
  if (Load<nlmsghdr>(*reply).nlmsg_type != NLMSG_ERROR || reply->size() < sizeof(nlmsghdr) + sizeof(nlmsgerr)) {
    return EBADMSG;
  }
  return -Load<nlmsgerr>(reply->subspan(sizeof(nlmsghdr))).error;
}

}  // namespace axlecast
