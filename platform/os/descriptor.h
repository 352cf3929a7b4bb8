#pragma once

#include <unistd.h>

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
  WakeEvent();

  // False when the process has too many files open.
  [[nodiscard]] bool valid() const { return event_.valid(); }
  // Readable from Set to Take.
  [[nodiscard]] int FileDescriptor() const { return event_.get(); }
  // May be called from a signal's handler.
  void Set() const;
  // True when Set was called since the last Take.
  bool Take() const;

 private:
  Descriptor event_;
};

}  // namespace axlecast
