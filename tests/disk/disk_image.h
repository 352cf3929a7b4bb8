#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/disk/disk_change.h"

namespace axlecast {

// A disk on which some changes are durable and others not, and the states in which a power cut may leave it.
//
// What POSIX guarantees (IEEE Std 1003.1-2017), and what is taken from it here:
// - fsync of a file: all its data, its size and its permissions are durable (fsync, "synchronized I/O file integrity completion").
// - fdatasync of a file: its data is durable, and of its size what is needed to read the data (3.384, "synchronized I/O data
//   integrity completion"). A truncation that no later write follows may still be lost.
// - Entries of a folder are not part of the file. They are durable after a sync of the folder. fdatasync of a folder counts too:
//   the entries are its data. This applies also to the entry of a folder in the folder above.
// - rename replaces a name in one step (rename): both names change, or neither.
// - Nothing is guaranteed about changes that were not synced, nor about their order. Two orders are taken as given, because the
//   kernel has one copy of each sector and of each entry: a sector or an entry has, after the cut, its value after one of its
//   changes, never a later change without an earlier one of the same place. A write after a truncation that is lost is lost too.
// - A sector of 512 bytes is written completely or not at all. (SQLite requires it, too: sqlite.org/psow.html.)
// - A file that has grown may contain zeros, other bytes or its own former bytes where its data is missing.
//
// ext4 and xfs guarantee more: a journal keeps the entries of all folders in order; ext4 with `auto_da_alloc` writes the data
// of a file before a rename over another one; fsync of a new file makes its name durable. Nothing of this is assumed here.
class DiskImage {
 public:
  static constexpr std::size_t kSector = 512;  // bytes

  // A file or folder. Numbers of nodes are given by the caller; 0 is the watched folder.
  struct Node {
    bool is_folder = false;
    std::int64_t mode = 0;
    std::string bytes = {};                   // of a file
    std::string former = {};                  // what a truncation cut off, at its place
    std::map<std::string, int> entries = {};  // of a folder
  };
  using Nodes = std::map<int, Node>;

  DiskImage() { nodes_[0].is_folder = true; }
  explicit DiskImage(Nodes durable) : nodes_(std::move(durable)) {}

  // Makes the next change. The object refers to it.
  void Apply(const DiskChange& change);
  // Returns a state after a power cut at this point.
  [[nodiscard]] Nodes Cut(const CutChoice& choice) const;

 private:
  struct Pending {
    std::size_t number;  // of the change
    const DiskChange* change;
  };
  class Survival;

  void SyncFile(int node, bool data_only);
  void SyncFolder(int node);
  static void Enter(Nodes& nodes, const DiskChange& change);
  static void CutFile(Node& file, const std::vector<Pending>& pending, const Survival& survival);
  [[nodiscard]] std::vector<std::size_t> PendingNumbers() const;

  Nodes nodes_;                                // as they are durable
  std::map<int, std::vector<Pending>> files_;  // changes of each file that are not durable
  std::vector<Pending> entries_;               // changes of folders that are not durable
  std::size_t count_ = 0;                      // changes so far
};

}  // namespace axlecast
