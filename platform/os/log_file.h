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
  // Both fail with EBUSY where somebody else writes the file by this class.
  // A new file, whose name lasts once Sync has returned. Fails with EEXIST where there is one.
  [[nodiscard]] int Create(const std::string& path);
  // Continues an existing file at `size`, and truncates it there.
  [[nodiscard]] int Continue(const std::string& path, std::int64_t size);

  // Writes from the front of `bytes`, and takes off what was written: all of it, or what there was room for.
  [[nodiscard]] int Write(Bytes& bytes);
  // Cuts the end off, back to `size`.
  [[nodiscard]] int CutTo(std::int64_t size);
  // What was written is on the disk when it returns.
  [[nodiscard]] int Sync();
  // Sync, and what is reserved is free again.
  [[nodiscard]] int Close();

  // Somebody, this process too, writes it by this class.
  [[nodiscard]] static bool IsBeingWritten(const std::string& path);

  [[nodiscard]] bool is_open() const { return file_.valid(); }
  [[nodiscard]] std::int64_t size() const { return size_; }
  // Bytes that the file system has left for this program; -1: unknown.
  [[nodiscard]] std::int64_t FreeBytes() const;

 private:
  [[nodiscard]] int SyncFolder() const;
  void Reserve(std::int64_t bytes);

  Descriptor file_;
  std::string path_;
  std::int64_t size_ = 0;
  std::int64_t reserved_ = 0;  // to here there is room, or was none
  bool name_lasts_ = false;
};

}  // namespace axlecast
