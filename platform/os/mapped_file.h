#pragma once

#include <sys/types.h>

#include <cstddef>
#include <memory>
#include <string>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"
#include "platform/os/new_file.h"

namespace axlecast {

// A file that is mapped for reading. Another process may truncate it, or its disk may fail, while it is read. Then an access
// to missing bytes raises SIGBUS, which would end the process. This class handles the signal and shows zeros instead: behind
// the new end of the file, or in a page that the disk cannot read. The handler is installed with the first mapping; any other
// SIGBUS ends the process.
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
  // Returns true if zeros were shown instead of bytes of the file.
  [[nodiscard]] bool fell() const;

 private:
  Descriptor file_;
  Bytes bytes_;
  std::size_t slot_ = kMax;  // of the table that the signal handler reads
  int error_ = 0;
};

// The content of a file at the time it was opened, read on access; the file may be larger than the memory. Data that is
// appended later is not visible. If the file is truncated, zeros are shown instead of the missing bytes.
class MappedFile {
 public:
  explicit MappedFile(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  // Why it cannot be read, with the remedy; empty when it can.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] Bytes bytes() const { return region_ == nullptr ? Bytes() : region_->bytes(); }
  // What of bytes() is not the file's any more, as a text; empty while all of it is. One system call.
  [[nodiscard]] std::string Loss() const;
  [[nodiscard]] mode_t mode() const { return mode_; }  // its permission bits
  // What a file that takes its place must have, as far as this process may give it: mode, and as root also its owner
  // and group.
  [[nodiscard]] FileAccess access() const;

 private:
  void Open();

  std::string path_;
  std::unique_ptr<MappedRegion> region_;  // null of an empty file
  mode_t mode_ = 0;
  uid_t owner_ = 0;
  gid_t group_ = 0;
  std::string problem_;
};

}  // namespace axlecast
