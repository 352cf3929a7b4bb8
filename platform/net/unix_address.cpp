#include "platform/net/unix_address.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/result.h"

namespace axlecast {

Result<Descriptor> BindUnixSocket(const std::string& path, int type) {
  const std::optional<UnixAddress> address = UnixAddress::Of(path);
  if (!address) return Failure(UnixAddress::TooLong(path));
  if (unlink(path.c_str()) != 0 && errno != ENOENT) return Failure(path + ": " + std::strerror(errno));
  Descriptor bound(socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  // The mode of the socket before bind is that of the file from its first moment on.
  if (!bound.valid() || fchmod(bound.get(), 0600) != 0 ||
      bind(bound.get(), address->generic(), address->size()) != 0) {
    return Failure(path + ": " + std::strerror(errno));
  }
  return bound;
}

}  // namespace axlecast
