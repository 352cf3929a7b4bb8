#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace axlecast {

// Owns a file descriptor.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor() { Reset(); }

  void Reset() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// Ends the wait of a thread that polls a file: an eventfd. Every function may be called from any thread.
class WakeEvent {
 public:
  WakeEvent() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

  // Returns false if the process has too many files open.
  [[nodiscard]] bool valid() const { return event_.valid(); }
  // Readable from Set to Take.
  [[nodiscard]] int FileDescriptor() const { return event_.get(); }
  // May be called from a signal handler.
  void Set() const {
    const std::uint64_t one = 1;
    // A full counter means that the event is readable already.
    [[maybe_unused]] const ssize_t written = write(event_.get(), &one, sizeof one);
  }
  // Returns true if Set was called since the last Take.
  bool Take() const {
    std::uint64_t times = 0;
    return read(event_.get(), &times, sizeof times) > 0;
  }

 private:
  Descriptor event_;
};

}  // namespace axlecast
