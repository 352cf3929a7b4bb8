#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "core/base/inline_bytes.h"
#include "platform/os/mapped_region.h"
#include "platform/os/new_file.h"

namespace axlecast {

// A file's content as it was when it was opened, read where it is looked at: also one larger than the memory. It may grow
// meanwhile, which is not seen. Where it becomes shorter, zeros stand for what is gone.
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
