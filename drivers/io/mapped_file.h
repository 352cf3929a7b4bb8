#pragma once

#include <sys/types.h>

#include <cstddef>
#include <string>

#include "drivers/io/new_file.h"
#include "drivers/runtime/core/inline_bytes.h"

namespace axlecast {

// A file's content as it was when it was opened, read where it is looked at: also one larger than the memory. It must
// not become shorter while it is looked at (it may grow).
class MappedFile {
 public:
  explicit MappedFile(const std::string& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;

  // Why it cannot be read, with the remedy; empty when it can.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] Bytes bytes() const { return {data_, size_}; }
  [[nodiscard]] mode_t mode() const { return mode_; }  // its permission bits
  // What a file that takes its place must have, as far as this process may give it: mode, and as root also its owner
  // and group.
  [[nodiscard]] FileAccess access() const;

 private:
  void Open(const std::string& path);

  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
  mode_t mode_ = 0;
  uid_t owner_ = 0;
  gid_t group_ = 0;
  std::string problem_;
};

}  // namespace axlecast
