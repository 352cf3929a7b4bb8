#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace axlecast {

class RecordedDisk;

// Passes the file calls of this process to the disks that record them.
class FileCalls {
 public:
  static void Watch(RecordedDisk& disk);
  static void Unwatch(RecordedDisk& disk);

  // While it lives, calls of this thread are not recorded.
  class Pause {
   public:
    Pause();
    ~Pause();
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;
  };
  // Calls of other threads wait while it lives, so that they are recorded in the order in which they are made.
  class Turn {
   public:
    Turn();
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
  };

  // Returns true if this thread's calls are recorded: some folder is watched.
  [[nodiscard]] static bool Records();

  // After a successful call, within a Turn. Calls that concern no watched folder are ignored.
  static void Opened(int file, const std::string& path, bool truncated, mode_t mode);
  static void Closed(int file);
  static void Wrote(int file, std::int64_t offset, const void* bytes, std::size_t size);
  static void Resized(int file, std::int64_t size);
  static void Reserved(int file, std::int64_t size);  // the file has at least this size
  static void ChangedMode(int file, mode_t mode);
  static void ResizedPath(const std::string& path, std::int64_t size);
  static void ChangedModeOfPath(const std::string& path, mode_t mode);
  static void Synced(int file, bool data_only);
  static void MadeFolder(const std::string& path);
  static void Linked(const std::string& from, const std::string& to);
  static void Removed(const std::string& path);
  static void Moved(const std::string& from, const std::string& to);

  // A planted fault: the next pwrite of this thread writes at most `size` bytes. With 0 or -1, it returns this size and sets errno to
  // `error`.
  static void PlantWrite(ssize_t size, int error);
  // Returns the planted size, once, and sets errno.
  [[nodiscard]] static std::optional<ssize_t> TakePlantedWrite();

  // A planted fault: after `passes` calls of `function` ("open", "fcntl" of a lock, "flock", "fstat", "pread" or "pwrite") for the file `path`, this thread's
  // next one fails with `error`.
  static void PlantFailure(const std::string& function, const std::string& path, int error, int passes = 0);
  // Returns true once for the call that fails, and sets errno.
  [[nodiscard]] static bool TakePlantedFailure(const char* function, const std::string& path);
  [[nodiscard]] static bool TakePlantedFailure(const char* function, int file);

  // Returns true if the file is recorded.
  [[nodiscard]] static bool Knows(int file);
};

}  // namespace axlecast
