#include "platform/net/unix_address.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace axlecast {

Result<UnixAddress> UnixAddress::Of(const std::string& path) {
  UnixAddress address;
  if (path.size() >= sizeof(address.address_.sun_path)) {
    return Failure(path + " is too long for a socket: set AXLECAST_RUN_DIR to a shorter directory");
  }
  address.address_.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.address_.sun_path);
  return address;
}

Result<Descriptor> BindUnixSocket(const std::string& path, int type) {
  const Result<UnixAddress> address = UnixAddress::Of(path);
  if (!address) return Failure(address.error());
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return Failure(path + ": " + std::strerror(errno));
  Descriptor bound(socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // The file gets the mode that the socket has before bind.
  if (!bound.valid() || fchmod(bound.get(), 0600) != 0 ||
      bind(bound.get(), address->generic(), address->size()) != 0) {
    return Failure(path + ": " + std::strerror(errno));
  }
  return bound;
}

}  // namespace axlecast
