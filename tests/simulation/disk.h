#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tests/disk/memory_folder.h"
#include "tests/disk/recorded_disk.h"

namespace axlecast::simulation {

// The durable files of one process. When the process is killed or its host loses power, the next one finds what is left of them in
// another folder, so that nothing that the ended one still does to its own folder can be seen.
class Disk {
 public:
  Disk() { Mount(); }

  [[nodiscard]] std::string folder() const { return root_.path() + "/" + std::to_string(mounts_); }
  // Ends a life. Destroy the objects of the process afterwards, then call Sweep.
  void Crash(const CutChoice& choice) {
    const std::unique_ptr<RecordedDisk> former = std::move(recorded_);
    const std::string next = root_.path() + "/" + std::to_string(mounts_ + 1);
    former->Cut(former->position(), choice, next);
    Mount();
  }
  // Removes the folder of the life before.
  void Sweep() const {
    std::error_code ignored;
    std::filesystem::remove_all(root_.path() + "/" + std::to_string(mounts_ - 1), ignored);
  }

 private:
  void Mount() {
    ++mounts_;
    std::filesystem::create_directories(folder());
    recorded_ = std::make_unique<RecordedDisk>(folder());
  }

  MemoryFolder root_;
  int mounts_ = 0;
  std::unique_ptr<RecordedDisk> recorded_;
};

}  // namespace axlecast::simulation
