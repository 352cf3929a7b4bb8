#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Who may use a file that is written.
struct FileAccess {
  mode_t mode = 0600;
  std::optional<gid_t> group = std::nullopt;  // none: this process's
  std::optional<uid_t> owner = std::nullopt;  // likewise; another owner requires root
};

// A file that is written piece by piece. It appears at `path` only when it is complete and on disk, and never with more
// rights than `access`. Without Commit, it is removed.
class NewFile {
 public:
  NewFile(std::string path, const FileAccess& access);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  // Adds to the end of the file. After an error, every later call returns the same error. An error never contains the
  // content.
  [[nodiscard]] Result<> Append(std::string_view content);
  // As Append, but writes small pieces together: some only in a later call. Returns false after an error, which Commit
  // returns. Not for secrets, and not to be mixed with Append.
  bool Collect(std::string_view piece);
  // Writes what was appended to the disk now, so that Commit of a large file does not do it all at once. Errors appear in Commit.
  void Flush();
  // Moves the file to `path`. Without `replace`, an existing file is kept and the call fails. With `keep`, the existing
  // file gets that name, which must be free and in the same folder. At any time, a complete file exists at `path`.
  [[nodiscard]] Result<> Commit(bool replace, const std::string& keep = "");

 private:
  std::string path_;
  std::string fresh_;  // its name until Commit
  Descriptor file_;
  std::string collected_;
  Result<> state_;  // the first error; nothing is written after it
};

// Writes a file with this content in one step, as NewFile does. When the function returns, the file is on disk.
[[nodiscard]] Result<> WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                                    bool replace);

// Writes a result to the path that an operator has given. A regular file is replaced in one step. Anything else
// (/dev/stdout, a pipe, the target of a link) is written directly.
[[nodiscard]] Result<> WriteOutput(const std::string& path, std::string_view content);

// Makes the name of the file durable: syncs its folder. Returns 0 or the errno.
[[nodiscard]] int SyncFolderOf(const std::string& path);

// Returns the id of a group; nothing if there is no group of that name.
[[nodiscard]] std::optional<gid_t> FindGroup(const std::string& name);

}  // namespace axlecast
