#pragma once

#include <cstdint>
#include <string>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A file that grows at its end. Space is reserved beyond the end without changing the size, so that readers see only written
// data. The functions return errno values; 0 means success.
class LogFile {
 public:
  // Creates a file, whose name is durable after Sync. Fails with EEXIST if the file exists, and with EBUSY as Continue does.
  [[nodiscard]] int Create(const std::string& path);
  // Continues an existing file at `size`, and truncates it there. Its name is durable after Sync. Fails with EBUSY if a LogFile writes to it.
  // After another error, the file may be open without its end: do not write it.
  [[nodiscard]] int Continue(const std::string& path, std::int64_t size);

  // Writes `bytes`, and removes from the front what was written. The rest remains if the disk is full.
  [[nodiscard]] int Write(Bytes& bytes);
  // Truncates the file to `size`.
  [[nodiscard]] int CutTo(std::int64_t size);
  // Returns when everything written is on the disk.
  [[nodiscard]] int Sync();
  // Releases the reserved space, syncs and closes.
  [[nodiscard]] int Close();

  // Returns true if a LogFile, of any process, writes to the file.
  [[nodiscard]] static bool IsBeingWritten(const std::string& path);

  [[nodiscard]] bool is_open() const { return file_.valid(); }
  [[nodiscard]] std::int64_t size() const { return size_; }
  // Bytes that are free for this process; -1: unknown.
  [[nodiscard]] std::int64_t FreeBytes() const;

 private:
  void Reserve(std::int64_t bytes);

  Descriptor file_;
  std::string path_;
  std::int64_t size_ = 0;
  std::int64_t reserved_ = 0;  // space was requested up to here
  bool name_is_durable_ = false;
};

}  // namespace axlecast
