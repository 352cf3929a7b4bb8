#pragma once

#include <span>

#include "core/base/time.h"
#include "core/device/link.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Waits on a file descriptor that does not block, and reads from it where it is a raw tty whose VMIN is 1: how every port
// of this folder hears. One thread uses it; Wake may be called from any.
class LineReader {
 public:
  explicit LineReader(const Clock& clock);

  // Empty when it can wait, else the cause.
  [[nodiscard]] std::string Problem() const;

  // From now on reads from `fd`, which others own and outlives the attachment; -1: from nothing.
  void Attach(int fd) { fd_ = fd; }
  void Detach() { fd_ = -1; }
  [[nodiscard]] bool IsAttached() const { return fd_ >= 0; }

  // As ByteLink has them.
  [[nodiscard]] ByteLink::ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline);
  [[nodiscard]] ByteLink::ReadResult ReadNow(std::span<std::uint8_t> into);
  [[nodiscard]] ByteLink::Status Wait(MonoNs until);
  void Wake();

  // False when the line takes no byte before `deadline`, or is gone.
  [[nodiscard]] bool WaitWritable(MonoNs deadline);

 private:
  const Clock& clock_;
  WakeEvent wake_;
  int fd_ = -1;
};

}  // namespace axlecast
