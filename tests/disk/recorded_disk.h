#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/disk/disk_change.h"
#include "tests/disk/disk_image.h"

namespace axlecast {

// Records every change that this process makes to the files below one folder, and builds the folder as a power cut would leave
// it. The changes are seen in the process's calls of the C library (file_calls.cpp), so the product and SQLite run as they are.
// A program that links this library has these calls.
//
// Several objects may watch separate folders at a time: one for each host of a simulation. After a cut, the host continues in the
// folder that Cut has written, watched by another object. The processes that the cut has ended may still be destroyed: they
// write to the former folder only.
//
// Not recorded: writes to a mapped file. The product makes none. SQLite maps `-shm`, and does not use its content after a power
// cut. The result depends only on the changes and the choice, never on time or on names. Thread-safe.
class RecordedDisk {
 public:
  // Begins to watch a folder, which exists. Its present content counts as durable. The product must use the same spelling of
  // the path, without symbolic links.
  explicit RecordedDisk(const std::string& folder);
  ~RecordedDisk();
  RecordedDisk(const RecordedDisk&) = delete;
  RecordedDisk& operator=(const RecordedDisk&) = delete;

  // The number of changes so far. Cut accepts each number from 0 to this one.
  [[nodiscard]] std::size_t position() const;
  // Writes into `target` what the folder may contain after a power cut that happens after the first `point` changes. `target` is
  // created, and emptied first. Points in rising order are fast.
  void Cut(std::size_t point, const CutChoice& choice, const std::string& target) const;
  // Takes the present content as durable, and continues with position 0.
  void Forget();

  // A planted fault, for the test of a test: syncs of files or of folders are not recorded from now on, as if the product did
  // not request them.
  void IgnoreSyncs(bool of_files, bool of_folders);

  // The change with this number, in words.
  [[nodiscard]] std::string Describe(std::size_t number) const;

 private:
  friend class FileCalls;

  // nullopt: no such name.
  [[nodiscard]] std::optional<int> Find(const std::string& path) const;
  // The node of the folder, and the last name.
  [[nodiscard]] std::optional<std::pair<int, std::string>> Place(const std::string& path) const;
  void Load(const std::string& folder, int node);
  void Record(DiskChange change);

  void Opened(int file, const std::string& path, bool truncated, std::uint32_t mode);
  void MadeFolder(const std::string& path);
  void Linked(const std::string& from, const std::string& to);
  void Removed(const std::string& path);
  void Moved(const std::string& from, const std::string& to);
  void Synced(int node, bool data_only);

  const std::string folder_;
  DiskImage::Nodes base_;  // when the watch began
  DiskImage::Nodes live_;  // now; without the bytes of files
  std::deque<DiskChange> changes_;
  bool ignores_files_ = false;
  bool ignores_folders_ = false;
  mutable DiskImage image_;  // after `image_point_` changes
  mutable std::size_t image_point_ = 0;
};

}  // namespace axlecast
