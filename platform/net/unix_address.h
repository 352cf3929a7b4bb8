#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The address of a local socket: a path of limited length.
class UnixAddress {
 public:
  // Returns nothing if the path is too long.
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

// Binds a local socket of this type to `path`, in place of the socket of an earlier process. Only processes of this user can
// reach it.
[[nodiscard]] Result<Descriptor> BindUnixSocket(const std::string& path, int type);

}  // namespace axlecast
