#include "platform/net/group_sender.h"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "platform/net/udpm_receiver.h"

namespace axlecast {
namespace {

// liblcm 1.3.1, lcm/udpm_util.h: LCM_SHORT_MESSAGE_MAX_SIZE, LCM_FRAGMENT_MAX_PAYLOAD.
constexpr std::size_t kMaxShort = 65'499;  // bytes of channel, NUL and message
constexpr std::size_t kMaxFragment = 65'487;
constexpr std::size_t kMaxFragments = 65'535;

constexpr MonoNs kLookInterval = 500 * kMillisecond;
constexpr MonoNs kErrorStays = 2 * kSecond;
constexpr MonoNs kLookAgain = 100 * kMillisecond;  // while nothing can be sent

void Put16(std::uint8_t* at, std::uint32_t value) {
  at[0] = static_cast<std::uint8_t>(value >> 8);
  at[1] = static_cast<std::uint8_t>(value);
}

void Put32(std::uint8_t* at, std::size_t value) {
  Put16(at, static_cast<std::uint32_t>(value >> 16));
  Put16(at + 2, static_cast<std::uint32_t>(value));
}

// A header of LCM and the channel with its NUL behind it.
using Head = std::array<std::uint8_t, kFragmentHeader + kLongestChannel + 1>;

// Puts the channel and its NUL at `at`. Returns the place behind.
std::size_t PutChannel(Head& head, std::size_t at, std::string_view channel) {
  std::uint8_t* end = std::copy(channel.begin(), channel.end(), head.data() + at);
  *end = 0;
  return at + channel.size() + 1;
}

}  // namespace

GroupSender::GroupSender(const LcmUrl& url)
    : group_(url), group_text_(url.group), socket_(OpenGroupSocket(group_)) {
  if (!url.interface.empty()) watch_.emplace(url);
  if (socket_.valid() && SetTtl(socket_.get(), group_, url.ttl)) return;
  send_error_ = errno;
  failed_ = clock_.Now();
}

bool GroupSender::Follow() {
  if (!watch_) return true;
  const MonoNs now = clock_.Now();
  if (now >= next_look_) {
    watch_->Update();
    next_look_ = now + (watch_->index() == 0 || send_error_ != 0 ? kLookAgain : kLookInterval);
  }
  if (watch_->index() != outgoing_) {
    const bool set = watch_->index() != 0 && SetOutgoing(socket_.get(), group_, watch_->index());
    outgoing_ = set ? watch_->index() : 0;
  }
  return outgoing_ != 0;
}

bool GroupSender::Send(std::string_view channel, Bytes message) {
  const std::scoped_lock lock(mutex_);
  const bool fits = channel.size() + 1 + message.size() <= kMaxShort;
  const bool named = !channel.empty() && channel.size() <= kLongestChannel;
  const bool sent = named && Follow() && (fits ? SendShort(channel, message) : SendFragments(channel, message));
  ++sequence_;  // also of a message that was not sent: its receivers have lost it
  return sent;
}

bool GroupSender::SendShort(std::string_view channel, Bytes message) {
  Head head;
  Put32(head.data(), kShortMagic);
  Put32(head.data() + 4, sequence_);
  return SendDatagram({head.data(), PutChannel(head, kShortHeader, channel)}, message);
}

bool GroupSender::SendFragments(std::string_view channel, Bytes message) {
  const std::size_t total = channel.size() + 1 + message.size();
  const std::size_t count = (total + kMaxFragment - 1) / kMaxFragment;
  if (count > kMaxFragments) return false;
  Head head;
  Put32(head.data(), kFragmentMagic);
  Put32(head.data() + 4, sequence_);
  Put32(head.data() + 8, message.size());
  Put16(head.data() + 18, static_cast<std::uint32_t>(count));
  std::size_t offset = 0;
  for (std::size_t number = 0; number < count; ++number) {
    // Only the first fragment names the channel.
    const std::size_t size = number == 0 ? PutChannel(head, kFragmentHeader, channel) : kFragmentHeader;
    const std::size_t room = kMaxFragment - (size - kFragmentHeader);
    const Bytes part = message.subspan(offset, std::min(room, message.size() - offset));
    Put32(head.data() + 12, offset);
    Put16(head.data() + 16, static_cast<std::uint32_t>(number));
    if (!SendDatagram({head.data(), size}, part)) return false;
    offset += part.size();
  }
  return true;
}

bool GroupSender::SendDatagram(Bytes head, Bytes part) {
  const auto piece = [](Bytes bytes) { return iovec{const_cast<std::uint8_t*>(bytes.data()), bytes.size()}; };
  std::array<iovec, 2> pieces = {piece(head), piece(part)};
  msghdr datagram{};
  datagram.msg_name = const_cast<sockaddr*>(group_.generic());
  datagram.msg_namelen = group_.size();
  datagram.msg_iov = pieces.data();
  datagram.msg_iovlen = pieces.size();
  ssize_t sent = 0;
  do {
    sent = sendmsg(socket_.get(), &datagram, 0);
  } while (sent < 0 && errno == EINTR);
  send_error_ = sent < 0 ? errno : 0;
  if (sent >= 0) return true;
  failed_ = clock_.Now();
  if (IsInterfaceError(send_error_)) next_look_ = std::min(next_look_, failed_ + kLookAgain);
  return false;
}

Result<> GroupSender::Check() {
  const std::scoped_lock lock(mutex_);
  static_cast<void>(Follow());  // also if nothing is sent
  if (watch_ && !watch_->problem().empty()) return Failure(watch_->problem());
  if (send_error_ == 0 || clock_.Now() > failed_ + kErrorStays) return {};
  return Failure("messages to " + group_text_ + " cannot be sent: " + std::strerror(send_error_));
}

}  // namespace axlecast
