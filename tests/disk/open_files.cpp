#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "tests/disk/file_calls.h"
#include "tests/disk/recorded_disk.h"

namespace axlecast {
namespace {

using Kind = DiskChange::Kind;

struct OpenFile {
  RecordedDisk* disk = nullptr;
  int node = 0;
};

// What file calls need to know: who records, and which files are open. It is never destroyed, because calls do not end.
struct Registry {
  std::recursive_mutex mutex;
  std::atomic<int> watched = 0;
  std::vector<RecordedDisk*> disks;
  std::map<int, OpenFile> files;
};

Registry& TheRegistry() {
  static Registry& registry = *new Registry;
  return registry;
}

thread_local int paused = 0;
thread_local std::optional<std::pair<ssize_t, int>> planted_write;  // size, errno

struct PlantedFailure {
  std::string function;
  std::string path;
  int error = 0;
  int passes = 0;
};
thread_local std::optional<PlantedFailure> planted_failure;

std::string Absolute(const std::string& path) {
  if (path.starts_with('/')) return std::filesystem::path(path).lexically_normal().string();
  return (std::filesystem::current_path() / path).lexically_normal().string();
}

}  // namespace

FileCalls::Pause::Pause() { ++paused; }
FileCalls::Pause::~Pause() { --paused; }
FileCalls::Turn::Turn() { TheRegistry().mutex.lock(); }
FileCalls::Turn::~Turn() { TheRegistry().mutex.unlock(); }

void FileCalls::Watch(RecordedDisk& disk) {
  const Turn turn;
  TheRegistry().disks.push_back(&disk);
  ++TheRegistry().watched;
}

void FileCalls::Unwatch(RecordedDisk& disk) {
  const Turn turn;
  Registry& registry = TheRegistry();
  std::erase(registry.disks, &disk);
  std::erase_if(registry.files, [&disk](const auto& entry) { return entry.second.disk == &disk; });
  --registry.watched;
}

bool FileCalls::Records() { return paused == 0 && TheRegistry().watched > 0; }

void FileCalls::PlantWrite(ssize_t size, int error) { planted_write.emplace(size, error); }

std::optional<ssize_t> FileCalls::TakePlantedWrite() {
  const auto planted = std::exchange(planted_write, std::nullopt);
  if (!planted) return std::nullopt;
  errno = planted->second;
  return planted->first;
}

void FileCalls::PlantFailure(const std::string& function, const std::string& path, int error, int passes) {
  planted_failure = {function, path, error, passes};
}

bool FileCalls::TakePlantedFailure(const char* function, const std::string& path) {
  if (!planted_failure || planted_failure->function != function || planted_failure->path != path) return false;
  if (planted_failure->passes-- > 0) return false;
  errno = std::exchange(planted_failure, std::nullopt)->error;
  return true;
}

bool FileCalls::TakePlantedFailure(const char* function, int file) {
  if (!planted_failure || planted_failure->function != function) return false;
  std::error_code error;
  const auto path = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(file), error);
  return TakePlantedFailure(function, path.string());
}

bool FileCalls::Knows(int file) { return TheRegistry().files.contains(file); }

void FileCalls::Opened(int file, const std::string& path, bool truncated, mode_t mode) {
  Closed(file);  // if it was closed by a call that is not recorded
  const std::string absolute = Absolute(path);
  for (RecordedDisk* const disk : TheRegistry().disks) {
    disk->Opened(file, absolute, truncated, mode);
    if (const auto node = disk->Find(absolute)) TheRegistry().files[file] = {disk, *node};
  }
}

void FileCalls::Closed(int file) { TheRegistry().files.erase(file); }

namespace {

// The open file; no disk: it is not recorded.
OpenFile FileOf(int file) {
  const auto found = TheRegistry().files.find(file);
  return found == TheRegistry().files.end() ? OpenFile() : found->second;
}

}  // namespace

void FileCalls::Wrote(int file, std::int64_t offset, const void* bytes, std::size_t size) {
  const auto [disk, node] = FileOf(file);
  if (disk == nullptr || size == 0) return;
  disk->Record({.kind = Kind::kWrite,
                .node = node,
                .value = offset,
                .bytes = std::string(static_cast<const char*>(bytes), size)});
}

void FileCalls::Resized(int file, std::int64_t size) {
  const auto [disk, node] = FileOf(file);
  if (disk != nullptr) disk->Record({.kind = Kind::kResize, .node = node, .value = size});
}

void FileCalls::Reserved(int file, std::int64_t size) {
  struct stat status {};
  if (fstat(file, &status) == 0 && status.st_size == size) Resized(file, size);
}

void FileCalls::ChangedMode(int file, mode_t mode) {
  const auto [disk, node] = FileOf(file);
  if (disk != nullptr) disk->Record({.kind = Kind::kMode, .node = node, .value = mode});
}

void FileCalls::ResizedPath(const std::string& path, std::int64_t size) {
  const std::string absolute = Absolute(path);
  for (RecordedDisk* const disk : TheRegistry().disks) {
    if (const auto node = disk->Find(absolute)) {
      disk->Record({.kind = Kind::kResize, .node = *node, .value = size});
    }
  }
}

void FileCalls::ChangedModeOfPath(const std::string& path, mode_t mode) {
  const std::string absolute = Absolute(path);
  for (RecordedDisk* const disk : TheRegistry().disks) {
    if (const auto node = disk->Find(absolute)) disk->Record({.kind = Kind::kMode, .node = *node, .value = mode});
  }
}

void FileCalls::Synced(int file, bool data_only) {
  const auto [disk, node] = FileOf(file);
  if (disk != nullptr) disk->Synced(node, data_only);
}

void FileCalls::MadeFolder(const std::string& path) {
  for (RecordedDisk* const disk : TheRegistry().disks) disk->MadeFolder(Absolute(path));
}

void FileCalls::Linked(const std::string& from, const std::string& to) {
  for (RecordedDisk* const disk : TheRegistry().disks) disk->Linked(Absolute(from), Absolute(to));
}

void FileCalls::Removed(const std::string& path) {
  for (RecordedDisk* const disk : TheRegistry().disks) disk->Removed(Absolute(path));
}

void FileCalls::Moved(const std::string& from, const std::string& to) {
  for (RecordedDisk* const disk : TheRegistry().disks) disk->Moved(Absolute(from), Absolute(to));
}

}  // namespace axlecast
