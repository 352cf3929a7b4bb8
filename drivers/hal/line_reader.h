#pragma once

#include <algorithm>
#include <array>
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

  // Returns an error if no wake-up event could be created.
  [[nodiscard]] Result<> CheckReady() const;

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

// What an SPI transfer has clocked in, until it is read.
class ClockedIn {
 public:
  // Room for `size` bytes, at most kMaxFrame, that are there to be read from now on; what was not read is dropped.
  [[nodiscard]] std::span<std::uint8_t> Fill(std::size_t size) {
    read_ = 0;
    size_ = size;
    return std::span(bytes_).first(size);
  }
  void Drop() { read_ = size_ = 0; }
  [[nodiscard]] bool empty() const { return read_ == size_; }

  // kOk, or kTimeout when nothing is there.
  [[nodiscard]] ByteLink::ReadResult Read(std::span<std::uint8_t> into) {
    const std::size_t count = std::min(into.size(), size_ - read_);
    if (count == 0) return {ByteLink::Status::kTimeout, 0};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(read_), count, into.begin());
    read_ += count;
    return {ByteLink::Status::kOk, count};
  }

 private:
  std::array<std::uint8_t, kMaxFrame> bytes_{};
  std::size_t read_ = 0;
  std::size_t size_ = 0;
};

}  // namespace axlecast
