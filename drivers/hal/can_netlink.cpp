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
#include <vector>

namespace axlecast {
namespace {

// The structure that `bytes` begin with; zeros when they are too few.
template <typename T>
T Load(Bytes bytes) {
  T value{};
  if (bytes.size() >= sizeof value) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

constexpr unsigned kTypeMask = 0x3FFF;  // NLA_TYPE_MASK

constexpr std::size_t Aligned(std::size_t size) { return (size + 3) & ~std::size_t{3}; }

// The attributes that follow one another in `bytes`, calling handle(type, value) for each; ends at the first that does
// not fit.
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

void TakeMode(std::uint32_t flags, CanInterface& interface) {
  interface.listen_only = (flags & CAN_CTRLMODE_LISTENONLY) != 0;
  interface.loopback = (flags & CAN_CTRLMODE_LOOPBACK) != 0;
  interface.one_shot = (flags & CAN_CTRLMODE_ONE_SHOT) != 0;
  interface.presume_ack = (flags & CAN_CTRLMODE_PRESUME_ACK) != 0;
}

void TakeCanAttribute(unsigned type, Bytes value, CanInterface& interface) {
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
      TakeMode(Load<can_ctrlmode>(value).flags, interface);
      break;
    default:
      break;
  }
}

bool NamesCan(Bytes kind) {
  const std::string_view text(reinterpret_cast<const char*>(kind.data()), kind.size());
  return text.substr(0, text.find('\0')) == "can";
}

void TakeLinkInfo(Bytes info, CanInterface& interface) {
  Bytes data;
  ForEachAttribute(info, [&](unsigned type, Bytes value) {
    if (type == IFLA_INFO_KIND) interface.is_controller = NamesCan(value);
    if (type == IFLA_INFO_DATA) data = value;
  });
  // The settings of another kind (vxcan, a bridge) have other numbers.
  if (!interface.is_controller) return;
  ForEachAttribute(data, [&](unsigned type, Bytes value) { TakeCanAttribute(type, value, interface); });
}

// A question about the one interface of this name.
struct Question {
  nlmsghdr header{};
  ifinfomsg info{};
  rtattr name_header{};
  std::array<char, IFNAMSIZ> name{};
  rtattr mask_header{};
  std::uint32_t mask = RTEXT_FILTER_SKIP_STATS;
};
static_assert(sizeof(Question) == 16 + 16 + 4 + 16 + 4 + 4, "as netlink lays it out");

// An order about an interface, put together attribute by attribute; the kernel acknowledges it.
class DriverCommand {
 public:
  DriverCommand(std::uint16_t type, int index, std::uint32_t sequence) {
    header_.nlmsg_type = type;
    header_.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
    header_.nlmsg_seq = sequence;
    info_.ifi_index = index;
    bytes_.resize(sizeof header_ + sizeof info_);
  }

  void SetFlags(unsigned flags, unsigned mask) {
    info_.ifi_flags = flags;
    info_.ifi_change = mask;
  }
  void Put(unsigned type, const void* value, std::size_t size) {
    const std::size_t at = Begin(type);
    const auto* bytes = static_cast<const std::uint8_t*>(value);
    bytes_.insert(bytes_.end(), bytes, bytes + size);
    End(at);
  }
  // An attribute that holds those that follow, until End.
  [[nodiscard]] std::size_t Begin(unsigned type) {
    const std::size_t at = bytes_.size();
    const rtattr header{.rta_len = 0, .rta_type = static_cast<std::uint16_t>(type)};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&header);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof header);
    return at;
  }
  void End(std::size_t at) {
    const auto size = static_cast<std::uint16_t>(bytes_.size() - at);
    std::memcpy(bytes_.data() + at, &size, sizeof size);  // rta_len
    bytes_.resize(Aligned(bytes_.size()));
  }

  [[nodiscard]] Bytes bytes() {
    header_.nlmsg_len = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    std::memcpy(bytes_.data() + sizeof header_, &info_, sizeof info_);
    return bytes_;
  }

 private:
  nlmsghdr header_{};
  ifinfomsg info_{};
  std::vector<std::uint8_t> bytes_;
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
    if (type == IFLA_LINKINFO) TakeLinkInfo(value, interface);
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

int CanNetlink::Send(const std::string& interface) {
  Question question;
  if (interface.empty() || interface.size() >= question.name.size()) return ENODEV;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = RTM_GETLINK;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.header.nlmsg_seq = ++sequence_;
  question.name_header = {sizeof(rtattr) + IFNAMSIZ, IFLA_IFNAME};
  interface.copy(question.name.data(), interface.size());
  question.mask_header = {sizeof(rtattr) + sizeof question.mask, IFLA_EXT_MASK};
  return SendBytes(&question, sizeof question);
}

int CanNetlink::SendBytes(const void* bytes, std::size_t size) {
  sockaddr_nl kernel{};
  kernel.nl_family = AF_NETLINK;
  const ssize_t sent =
      sendto(socket_.get(), bytes, size, 0, reinterpret_cast<const sockaddr*>(&kernel), sizeof kernel);
  return sent < 0 ? errno : 0;
}

tl::expected<Bytes, int> CanNetlink::Receive() {
  // The kernel answers before the send returns.
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
  if (const int error = Send(interface); error != 0) return tl::unexpected(error);
  return Receive().and_then(ParseCanInterface);
}

// ---- changes ----

int CanNetlink::Configure(const CanInterface& interface, std::int64_t bitrate, bool listen_only) {
  can_ctrlmode mode{};
  mode.mask = CAN_CTRLMODE_LISTENONLY;
  mode.flags = listen_only ? CAN_CTRLMODE_LISTENONLY : 0;
  can_bittiming timing{};  // the kernel works out the rest
  timing.bitrate = static_cast<std::uint32_t>(bitrate);
  DriverCommand order(RTM_NEWLINK, interface.index, ++sequence_);
  const std::size_t info = order.Begin(IFLA_LINKINFO);
  order.Put(IFLA_INFO_KIND, "can", 3);
  const std::size_t data = order.Begin(IFLA_INFO_DATA);
  order.Put(IFLA_CAN_CTRLMODE, &mode, sizeof mode);
  if (bitrate > 0) order.Put(IFLA_CAN_BITTIMING, &timing, sizeof timing);
  order.End(data);
  order.End(info);
  return Do(order.bytes());
}

int CanNetlink::Switch(const CanInterface& interface, bool up) {
  DriverCommand order(RTM_NEWLINK, interface.index, ++sequence_);
  order.SetFlags(up ? IFF_UP : 0, IFF_UP);
  return Do(order.bytes());
}

int CanNetlink::Do(Bytes order) {
  if (const int error = SendBytes(order.data(), order.size()); error != 0) return error;
  const tl::expected<Bytes, int> reply = Receive();
  if (!reply) return reply.error();
  if (Load<nlmsghdr>(*reply).nlmsg_type != NLMSG_ERROR || reply->size() < sizeof(nlmsghdr) + sizeof(nlmsgerr)) {
    return EBADMSG;
  }
  return -Load<nlmsgerr>(reply->subspan(sizeof(nlmsghdr))).error;
}

}  // namespace axlecast
