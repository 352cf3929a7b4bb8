#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace axlecast {

// One change of a watched folder, as a process made it. A node is a file or a folder; number 0 is the watched folder.
struct DiskChange {
  enum class Kind : std::uint8_t {
    kWrite,     // `bytes` at `value` of file `node`
    kResize,    // file `node` has `value` bytes
    kMode,      // file `node` has the permissions `value`
    kSync,      // fsync of `node`
    kSyncData,  // fdatasync of `node`
    kMakeFile,  // a new file `node` with the permissions `value` as `name` in `folder`
    kMakeFolder,
    kLink,    // a further name of file `node`
    kRemove,  // of `name` from `folder`
    kMove,    // of `node` from `name` in `folder` to `to_name` in `to_folder`
  };

  Kind kind = Kind::kWrite;
  int node = 0;
  std::int64_t value = 0;
  std::string bytes = {};
  int folder = 0;
  std::string name = {};
  int to_folder = 0;
  std::string to_name = {};

  [[nodiscard]] bool IsEntry() const { return kind >= Kind::kMakeFile; }
};

// Selects what survives of the changes that were not synced.
struct CutChoice {
  enum class Kind : std::uint8_t {
    kNothing,     // none of them
    kEverything,  // all of them
    kTorn,        // all, but the last write only in its first half
    kRandom,      // by `seed`: each sector, size and entry kept or lost
  };
  Kind kind = Kind::kRandom;
  std::uint64_t seed = 0;
};

}  // namespace axlecast
