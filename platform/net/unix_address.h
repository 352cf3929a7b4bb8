#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <string>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// The address of a local socket.
class UnixAddress {
 public:
  // Fails if the path is too long.
  [[nodiscard]] static Result<UnixAddress> Of(const std::string& path);

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
