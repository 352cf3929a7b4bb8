#pragma once

#include <cstddef>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A file that is mapped for reading, and that somebody else may make shorter, or whose disk may fail, while it is looked
// at. The kernel answers a look at bytes that are gone with SIGBUS, which ends a process; here zeros stand there instead:
// from where the file ends now on, or in a page that the disk cannot read. SIGBUS of the process is taken from the first
// mapping on; one of anything else ends the process as ever.
class MappedRegion {
 public:
  static constexpr std::size_t kMax = 1'024;  // in a process at a time

  // Of the file's first `size` bytes, > 0.
  MappedRegion(Descriptor file, std::size_t size);
  ~MappedRegion();
  MappedRegion(const MappedRegion&) = delete;
  MappedRegion& operator=(const MappedRegion&) = delete;

  [[nodiscard]] int error() const { return error_; }  // errno, where nothing could be mapped; else 0
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  // Of the bytes how many the file holds now.
  [[nodiscard]] std::size_t Left() const;
  // Whether zeros stood, or stand, for bytes that the file had.
  [[nodiscard]] bool fell() const;

 private:
  Descriptor file_;
  Bytes bytes_;
  std::size_t slot_ = kMax;  // of the table that the signal handler reads
  int error_ = 0;
};

}  // namespace axlecast
