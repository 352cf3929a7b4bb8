#include "platform/os/descriptor.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>

namespace axlecast {

WakeEvent::WakeEvent() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

void WakeEvent::Set() const {
  const std::uint64_t one = 1;
  // A full counter means that the event is readable already.
  [[maybe_unused]] const ssize_t written = write(event_.get(), &one, sizeof one);
}

bool WakeEvent::Take() const {
  std::uint64_t times = 0;
  return read(event_.get(), &times, sizeof times) > 0;
}

}  // namespace axlecast
