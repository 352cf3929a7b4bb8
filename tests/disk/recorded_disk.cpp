#include "tests/disk/recorded_disk.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

#include "platform/os/descriptor.h"
#include "tests/disk/file_calls.h"

namespace axlecast {
namespace {

using Kind = DiskChange::Kind;

[[noreturn]] void Throw(const std::string& path) { throw std::system_error(errno, std::generic_category(), path); }

void WriteFile(const std::string& path, const DiskImage::Node& file) {
  const auto mode = static_cast<mode_t>(file.mode);
  const Descriptor made(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!made.valid() || fchmod(made.get(), mode) != 0) Throw(path);
  if (write(made.get(), file.bytes.data(), file.bytes.size()) != static_cast<ssize_t>(file.bytes.size()))
    Throw(path);
}

// `places`: where each file was written; its further names become links.
void WriteFolder(const DiskImage::Nodes& nodes, int node, const std::string& path,
                 std::map<int, std::string>& places) {
  for (const auto& [name, number] : nodes.at(node).entries) {
    const std::string place = path + '/' + name;
    const DiskImage::Node& entry = nodes.at(number);
    if (entry.is_folder) {
      if (mkdir(place.c_str(), static_cast<mode_t>(entry.mode)) != 0) Throw(place);
      WriteFolder(nodes, number, place, places);
    } else if (const auto [first, is_new] = places.emplace(number, place); is_new) {
      WriteFile(place, entry);
    } else if (link(first->second.c_str(), place.c_str()) != 0) {
      Throw(place);
    }
  }
}

}  // namespace

RecordedDisk::RecordedDisk(const std::string& folder)
    : folder_(std::filesystem::absolute(folder).lexically_normal().string()) {
  const FileCalls::Turn turn;
  Forget();
  FileCalls::Watch(*this);
}

RecordedDisk::~RecordedDisk() { FileCalls::Unwatch(*this); }

std::size_t RecordedDisk::position() const {
  const FileCalls::Turn turn;
  return changes_.size();
}

void RecordedDisk::Forget() {
  const FileCalls::Turn turn;
  const FileCalls::Pause pause;
  // Files that are open keep their numbers.
  for (auto& [number, node] : live_) node.entries.clear();
  live_[0].is_folder = true;
  base_.clear();
  base_[0].is_folder = true;
  Load(folder_, 0);
  changes_.clear();
  image_ = DiskImage(base_);
  image_point_ = 0;
}

void RecordedDisk::Load(const std::string& folder, int node) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    struct stat status {};
    if (lstat(entry.path().c_str(), &status) != 0) Throw(entry.path().string());
    int number = 0;
    for (const auto& [known, file] : live_) {
      // `former` of a live node: its inode.
      if (known != 0 && file.former == std::to_string(status.st_ino)) number = known;
    }
    if (number == 0) number = live_.rbegin()->first + 1;
    DiskImage::Node loaded{.is_folder = S_ISDIR(status.st_mode), .mode = status.st_mode & 07777U};
    live_[number] = loaded;
    live_[number].former = std::to_string(status.st_ino);
    live_[node].entries[name] = number;
    base_[node].entries[name] = number;
    if (!loaded.is_folder) {
      std::ifstream file(entry.path(), std::ios::binary);
      loaded.bytes.resize(static_cast<std::size_t>(status.st_size));
      file.read(loaded.bytes.data(), status.st_size);
    }
    loaded.entries = std::move(base_[number].entries);
    base_[number] = std::move(loaded);
    if (base_[number].is_folder) Load(entry.path().string(), number);
  }
}

void RecordedDisk::Cut(std::size_t point, const CutChoice& choice, const std::string& target) const {
  const FileCalls::Turn turn;
  const FileCalls::Pause pause;
  if (point < image_point_) {
    image_ = DiskImage(base_);
    image_point_ = 0;
  }
  for (; image_point_ < point; ++image_point_) image_.Apply(changes_.at(image_point_));
  const DiskImage::Nodes nodes = image_.Cut(choice);
  std::filesystem::remove_all(target);
  std::filesystem::create_directories(target);
  std::map<int, std::string> places;
  WriteFolder(nodes, 0, target, places);
}

void RecordedDisk::IgnoreSyncs(bool of_files, bool of_folders) {
  const FileCalls::Turn turn;
  ignores_files_ = of_files;
  ignores_folders_ = of_folders;
}

std::string RecordedDisk::Describe(std::size_t number) const {
  const FileCalls::Turn turn;
  if (number >= changes_.size()) return "the end";
  const DiskChange& change = changes_[number];
  const auto node = [](int index) { return " node " + std::to_string(index); };
  switch (change.kind) {
    case Kind::kWrite:
      return "write" + node(change.node) + " at " + std::to_string(change.value) + ", " +
             std::to_string(change.bytes.size()) + " bytes";
    case Kind::kResize:
      return "resize" + node(change.node) + " to " + std::to_string(change.value);
    case Kind::kMode:
      return "chmod" + node(change.node);
    case Kind::kSync:
      return "fsync" + node(change.node);
    case Kind::kSyncData:
      return "fdatasync" + node(change.node);
    case Kind::kMakeFile:
      return "create" + node(change.node) + " " + change.name;
    case Kind::kMakeFolder:
      return "mkdir" + node(change.node) + " " + change.name;
    case Kind::kLink:
      return "link" + node(change.node) + " " + change.name;
    case Kind::kRemove:
      return "unlink " + change.name;
    case Kind::kMove:
      return "rename" + node(change.node) + " " + change.name + " to " + change.to_name;
  }
  return "";
}

std::optional<std::pair<int, std::string>> RecordedDisk::Place(const std::string& path) const {
  if (!path.starts_with(folder_ + '/')) return std::nullopt;
  const std::filesystem::path below = path.substr(folder_.size() + 1);
  int node = 0;
  for (const auto& part : below.parent_path()) {
    const auto& entries = live_.at(node).entries;
    const auto found = entries.find(part.string());
    if (found == entries.end()) return std::nullopt;
    node = found->second;
  }
  return std::pair(node, below.filename().string());
}

std::optional<int> RecordedDisk::Find(const std::string& path) const {
  if (path == folder_) return 0;
  const auto place = Place(path);
  if (!place) return std::nullopt;
  const auto& entries = live_.at(place->first).entries;
  const auto found = entries.find(place->second);
  return found == entries.end() ? std::nullopt : std::optional(found->second);
}

void RecordedDisk::Record(DiskChange change) { changes_.push_back(std::move(change)); }

void RecordedDisk::Opened(int file, const std::string& path, bool truncated, std::uint32_t mode) {
  if (const auto node = Find(path)) {
    if (truncated) Record({.kind = Kind::kResize, .node = *node});
    return;
  }
  const auto place = Place(path);
  if (!place) return;
  struct stat status {};
  const bool known = fstat(file, &status) == 0;
  const int node = live_.rbegin()->first + 1;
  live_[node] = {.mode = known ? status.st_mode & 07777U : mode, .former = std::to_string(status.st_ino)};
  live_[place->first].entries[place->second] = node;
  Record({.kind = Kind::kMakeFile,
          .node = node,
          .value = live_[node].mode,
          .folder = place->first,
          .name = place->second});
}

void RecordedDisk::MadeFolder(const std::string& path) {
  const auto place = Place(path);
  if (!place) return;
  struct stat status {};
  const bool known = stat(path.c_str(), &status) == 0;
  const int node = live_.rbegin()->first + 1;
  live_[node] = {.is_folder = true, .mode = known ? status.st_mode & 07777U : 0700U};
  live_[node].former = std::to_string(status.st_ino);
  live_[place->first].entries[place->second] = node;
  Record({.kind = Kind::kMakeFolder,
          .node = node,
          .value = live_[node].mode,
          .folder = place->first,
          .name = place->second});
}

void RecordedDisk::Linked(const std::string& from, const std::string& to) {
  const auto node = Find(from);
  const auto place = Place(to);
  if (!node || !place) return;
  live_[place->first].entries[place->second] = *node;
  Record({.kind = Kind::kLink, .node = *node, .folder = place->first, .name = place->second});
}

void RecordedDisk::Removed(const std::string& path) {
  const auto node = Find(path);
  const auto place = Place(path);
  if (!node || !place) return;
  live_[place->first].entries.erase(place->second);
  Record({.kind = Kind::kRemove, .node = *node, .folder = place->first, .name = place->second});
}

void RecordedDisk::Moved(const std::string& from, const std::string& to) {
  const auto node = Find(from);
  const auto place = Place(from);
  const auto target = Place(to);
  if (!node || !place || !target) return;
  live_[place->first].entries.erase(place->second);
  live_[target->first].entries[target->second] = *node;
  Record({.kind = Kind::kMove,
          .node = *node,
          .folder = place->first,
          .name = place->second,
          .to_folder = target->first,
          .to_name = target->second});
}

void RecordedDisk::Synced(int node, bool data_only) {
  if (live_.at(node).is_folder ? ignores_folders_ : ignores_files_) return;
  Record({.kind = data_only ? Kind::kSyncData : Kind::kSync, .node = node});
}

}  // namespace axlecast
