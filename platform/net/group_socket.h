#pragma once

#include <sys/socket.h>

#include <string>

#include "core/base/result.h"
#include "core/messages/lcm_url.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The socket options of LCM's multicast groups, the same for IPv4 and IPv6. An interface is the kernel's index; 0: the route of the
// group selects it.

// Calls setsockopt(2). Returns false with errno set.
template <typename T>
[[nodiscard]] bool SetOption(int socket, int level, int name, const T& value) {
  return setsockopt(socket, level, name, &value, sizeof value) == 0;
}

// The group and the port of a URL.
class GroupAddress {
 public:
  explicit GroupAddress(const LcmUrl& url);

  [[nodiscard]] int family() const { return storage_.ss_family; }
  [[nodiscard]] const sockaddr* generic() const { return reinterpret_cast<const sockaddr*>(&storage_); }
  [[nodiscard]] socklen_t size() const { return size_; }

 private:
  sockaddr_storage storage_{};
  socklen_t size_ = 0;
};

// Opens a UDP socket of the group's family, with `flags` of socket(2). Not valid if the system refuses it.
[[nodiscard]] Descriptor OpenGroupSocket(const GroupAddress& group, int flags = 0);

// Binds a socket to the group and its port, so that it receives only groups that it has joined itself. Join the group first:
// otherwise the socket could receive one or two messages before it is set up, and then none until it has joined.
[[nodiscard]] Result<> BindToGroup(int socket, const GroupAddress& group);
// Fails with errno set.
[[nodiscard]] bool JoinGroup(int socket, const GroupAddress& group, unsigned interface);
void LeaveGroup(int socket, const GroupAddress& group, unsigned interface);

// Return false with errno set: the number of routers plus one that a datagram may pass (0: it stays on this host), and the
// interface by which it leaves.
[[nodiscard]] bool SetTtl(int socket, const GroupAddress& group, int ttl);
[[nodiscard]] bool SetOutgoing(int socket, const GroupAddress& group, unsigned interface);

// Returns true for the errors of a socket whose interface is missing, is down, or has no address yet.
[[nodiscard]] bool IsInterfaceError(int error);

}  // namespace axlecast
