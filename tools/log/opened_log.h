#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "core/base/inline_bytes.h"
#include "platform/os/mapped_file.h"

namespace axlecast {

// The content of a log for reading, compressed (tools/log/compressed_log.h) or not. All readers of logs open them here. If `path` does
// not exist and `path`.zst does, that file is read: the recorder may have compressed the log meanwhile.
//
// A compressed log is decompressed into a file without a name in `scratch` ($TMPDIR, else /tmp), which is then mapped: readers access
// any place of a log. If the file is damaged, what can be decompressed is shown, and damage() reports the rest.
class OpenedLog {
 public:
  // Reports the progress of a decompression: bytes of the compressed file.
  using Progress = std::function<void(std::size_t done, std::size_t total)>;

  explicit OpenedLog(const std::string& path, const Progress& progress = {}, const std::string& scratch = "");

  [[nodiscard]] const std::string& path() const { return file_.path(); }
  // The reason why the log cannot be read, with the remedy. Empty: it can be read.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] Bytes bytes() const { return content_ ? content_->bytes() : file_.bytes(); }
  [[nodiscard]] bool compressed() const { return content_.has_value(); }
  // Returns the size of the file when it was opened.
  [[nodiscard]] std::size_t file_bytes() const { return file_.bytes().size(); }
  // Reports which part of the log was lost since it was opened; no text if nothing was lost.
  [[nodiscard]] std::string Loss() const;
  // Reports what could not be decompressed; no text if the file is whole or not compressed.
  [[nodiscard]] const std::string& damage() const { return damage_; }
  [[nodiscard]] mode_t mode() const { return file_.mode(); }
  [[nodiscard]] FileAccess access() const { return file_.access(); }

 private:
  void Decompress(const Progress& progress, const std::string& folder);

  MappedFile file_;
  std::optional<MappedFile> content_;  // of a compressed file
  std::string damage_;
  std::string problem_;
};

}  // namespace axlecast
