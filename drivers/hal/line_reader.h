#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "core/base/time.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Waits on a non-blocking file descriptor, and reads from it if it is a raw tty whose VMIN is 1. Every port of this folder
// receives with it. Used by one thread, except Wake.
class LineReader {
 public:
  explicit LineReader(const Clock& clock) : clock_(clock) {}

  // Returns an error if no wake-up event could be created.
  [[nodiscard]] Result<> CheckReady() const;

  // Reads from `fd` until Detach. The caller owns `fd`, and closes it after Detach. `blocking_fd` is the same line opened without
  // O_NONBLOCK, or -1: reads that follow closely wait in it, which saves a system call each (call_timer.h).
  void Attach(int fd, int blocking_fd = -1) {
    fd_ = fd;
    blocking_fd_ = blocking_fd;
  }
  void Detach() { fd_ = blocking_fd_ = -1; }
  [[nodiscard]] bool IsAttached() const { return fd_ >= 0; }

  // See ByteLink.
  [[nodiscard]] ByteLink::ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline);
  [[nodiscard]] ByteLink::ReadResult ReadNow(std::span<std::uint8_t> into);
  [[nodiscard]] ByteLink::Status Wait(MonoNs until);
  void Wake() { wake_.Set(); }

  // Returns false if the line accepts no byte before `deadline`, or is lost.
  [[nodiscard]] bool WaitWritable(MonoNs deadline);

 private:
  [[nodiscard]] bool TimerPays(MonoNs deadline);
  [[nodiscard]] std::optional<ByteLink::ReadResult> ReadBlocking(std::span<std::uint8_t> into, MonoNs deadline);

  const Clock& clock_;
  WakeEvent wake_;
  int fd_ = -1;
  int blocking_fd_ = -1;
  MonoNs last_began_ = 0;  // the last Read that found no timer set
};

// An SPI bus: its bytes are clocked in by a transfer, until they are read.
class ClockedLink : public ByteLink {
 public:
  [[nodiscard]] bool SetBaud(std::int64_t) override { return false; }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override {
    if (!IsOpen()) return {Status::kLost, 0};
    const std::size_t count = std::min(into.size(), size_ - read_);
    if (count == 0) return {Status::kTimeout, 0};
    std::copy_n(bytes_.begin() + static_cast<std::ptrdiff_t>(read_), count, into.begin());
    read_ += count;
    return {Status::kOk, count};
  }
  void Wake() override { waiter_.Wake(); }
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 protected:
  ClockedLink(std::string path, SpiSettings settings, const Clock& clock)
      : path_(std::move(path)), settings_(settings), clock_(clock), waiter_(clock) {}

  // Returns the place for the next `size` bytes, at most kMaxFrame. Drops what was not read.
  [[nodiscard]] std::span<std::uint8_t> Fill(std::size_t size) {
    read_ = 0;
    size_ = size;
    return std::span(bytes_).first(size);
  }
  void DropBytes() { read_ = size_ = 0; }
  [[nodiscard]] bool HasBytes() const { return read_ < size_; }

  const std::string path_;
  const SpiSettings settings_;  // of every Write
  const Clock& clock_;
  LineReader waiter_;

 private:
  std::array<std::uint8_t, kMaxFrame> bytes_{};
  std::size_t read_ = 0;
  std::size_t size_ = 0;
};

}  // namespace axlecast
