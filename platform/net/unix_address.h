#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <optional>
#include <string>

#include "platform/os/descriptor.h"

namespace axlecast {

// The address of a local socket: a path, which must be short.
class UnixAddress {
 public:
  // No value when the path is too long for one.
  [[nodiscard]] static std::optional<UnixAddress> Of(const std::string& path) {
    UnixAddress address;
    if (path.size() >= sizeof(address.address_.sun_path)) return std::nullopt;
    address.address_.sun_family = AF_UNIX;
    std::copy(path.begin(), path.end(), address.address_.sun_path);
    return address;
  }
  [[nodiscard]] static std::string TooLong(const std::string& path) {
    return path + " is too long for a socket: set AXLECAST_RUN_DIR to a shorter directory";
  }

  [[nodiscard]] const sockaddr* generic() const { return reinterpret_cast<const sockaddr*>(&address_); }
  [[nodiscard]] static socklen_t size() { return sizeof(sockaddr_un); }

 private:
  UnixAddress() = default;

  sockaddr_un address_{};
};

// A local socket of this type bound to `path`, taken over from a process that has gone, that only this user's processes
// reach. Empty when `into` is it, else the cause and the remedy.
[[nodiscard]] std::string BindUnixSocket(const std::string& path, int type, Descriptor& into);

}  // namespace axlecast
