#pragma once

#include "platform/os/descriptor.h"

namespace axlecast {

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
