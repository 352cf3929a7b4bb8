#include "tools/log/opened_log.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "tools/log/compressed_log.h"
#include "tools/log/log_event.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

std::string FoundPath(const std::string& path) {
  std::error_code error;
  std::string compressed = path + std::string(kCompressedEnding);
  const bool is_there = std::filesystem::exists(std::filesystem::symlink_status(path, error));
  return !is_there && std::filesystem::exists(compressed, error) ? compressed : path;
}

std::string TemporaryFolderPath() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != 0 ? folder : "/tmp";
}

// Returns a file without a name, which ends with the process however that ends.
Descriptor OpenUnnamed(const std::string& folder) {
  Descriptor file(open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (file.valid() || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) return file;
  std::string name = folder + "/axlecast-log.XXXXXX";  // a file system without O_TMPFILE
  file = Descriptor(mkostemp(name.data(), O_CLOEXEC));
  if (file.valid()) unlink(name.c_str());
  return file;
}

bool WriteAll(const Descriptor& file, Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(file.get(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

std::string TextOf(const std::string& path, const std::vector<CompressedDamage>& damage) {
  if (damage.empty()) return "";
  std::size_t bytes = 0;
  for (const CompressedDamage& region : damage) bytes += region.size;
  return path + ": " + std::to_string(bytes) + " compressed bytes in " + std::to_string(damage.size()) +
         (damage.size() == 1 ? " place" : " places") + ", the first at byte " +
         std::to_string(damage.front().offset) + ", are damaged: a part of the log is missing";
}

}  // namespace

OpenedLog::OpenedLog(const std::string& path, const Progress& progress, const std::string& scratch)
    : file_(FoundPath(path)), problem_(file_.problem()) {
  if (!problem_.empty() || file_.bytes().empty()) return;
  // The beginning of a compressed file may be damaged.
  const bool is_log = ParseEvent(file_.bytes()).has_value();
  if (IsCompressed(file_.bytes()) || (!is_log && file_.path().ends_with(kCompressedEnding)))
    Decompress(progress, scratch.empty() ? TemporaryFolderPath() : scratch);
}

void OpenedLog::Decompress(const Progress& progress, const std::string& folder) {
  Descriptor file = OpenUnnamed(folder);
  int error = file.valid() ? 0 : errno;
  std::vector<CompressedDamage> damage;
  if (error == 0) {
    damage = axlecast::Decompress(file_.bytes(), [&](Bytes piece, std::size_t position) {
      if (!WriteAll(file, piece)) error = errno;
      if (progress) progress(position, file_.bytes().size());
      return error == 0;
    });
    // The end of a frame is no content, so that it reports nothing.
    if (progress && error == 0) progress(file_.bytes().size(), file_.bytes().size());
  }
  if (error != 0) {
    const auto summary = FindSummary(file_.bytes());
    problem_ = file_.path() + " cannot be decompressed: " + folder + ": " + std::strerror(error) +
               (summary ? "; it needs " + std::to_string(summary->bytes) + " bytes there" : "") +
               ": set TMPDIR to a folder with enough space";
    return;
  }
  damage_ = TextOf(file_.path(), damage);
  content_.emplace(std::move(file), file_.path());
  problem_ = content_->problem();
  if (!damage.empty() && content_->bytes().empty())
    problem_ = file_.path() + " contains nothing that can be decompressed: is it a compressed log?";
}

std::string OpenedLog::Loss() const {
  std::string loss = file_.Loss();
  return loss.empty() && content_ ? content_->Loss() : loss;
}

}  // namespace axlecast
