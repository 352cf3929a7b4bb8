#pragma once

#include <sys/types.h>

#include <cstddef>
#include <memory>
#include <string>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"
#include "platform/os/new_file.h"

namespace axlecast {

// The content of a file at the time it was opened, mapped for reading; the file may be larger than the memory. Data that is
// appended later is not visible.
//
// Mapped, because LogReader, SeekTime and the merge of logs access any place of a log, and their events refer to it.
//
// Another process may truncate the file, or its disk may fail, while it is read. An access to missing bytes then raises SIGBUS,
// which would end the process. This class handles the signal and shows zeros instead: behind the new end of the file, or in a
// page that cannot be read. The handler is installed with the first mapping; any other SIGBUS ends the process.
class MappedFile {
 public:
  static constexpr std::size_t kMax = 1'024;  // mapped files in a process

  explicit MappedFile(const std::string& path);
  // Maps an open file. `name`: for texts about it.
  MappedFile(Descriptor file, std::string name);
  ~MappedFile();
  MappedFile(MappedFile&&) noexcept;
  MappedFile& operator=(MappedFile&&) noexcept;

  [[nodiscard]] const std::string& path() const { return path_; }
  // The reason why the file cannot be read, with the remedy. Empty: it can be read.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  // Reports which part of bytes() was lost since the file was opened; no text if nothing was lost. One system call.
  [[nodiscard]] std::string Loss() const;
  [[nodiscard]] mode_t mode() const { return mode_; }  // permission bits
  // Returns the access of a file that replaces this one, as far as this process may set it: mode, and as root also owner and
  // group.
  [[nodiscard]] FileAccess access() const;

 private:
  class Mapping;

  void Map(Descriptor file);

  std::string path_;
  std::unique_ptr<Mapping> mapping_;  // null for an empty file
  Bytes bytes_;
  mode_t mode_ = 0;
  uid_t owner_ = 0;
  gid_t group_ = 0;
  std::string problem_;
};

}  // namespace axlecast
