#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

#include "drivers/io/descriptor.h"

namespace axlecast {

// Who may use a file that is written.
struct FileAccess {
  mode_t mode = 0600;
  std::optional<gid_t> group = std::nullopt;  // none: this process's
};

// A file that is written piece by piece and stands at `path` only when it is whole: then in one step, on disk, with its
// access. What was not kept leaves nothing behind.
class NewFile {
 public:
  // Without `replace` a file that is there already stays.
  NewFile(std::string path, const FileAccess& access, bool replace);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  // False when it cannot be written, now or before.
  bool Write(std::string_view content);

  // After it nothing can be written. An empty string, else the cause of the first failure, and the remedy.
  [[nodiscard]] std::string Keep();

 private:
  [[nodiscard]] bool Flush();

  std::string path_;
  std::string fresh_;  // its name until it is kept
  FileAccess access_;
  bool replace_;
  Descriptor file_;
  std::string waiting_;
  std::string problem_;
};

// Puts a file with this content at `path` in one step, on disk when it returns: nobody ever sees a part of it, or sees
// it more open than `access` says. Without `replace` a file that is there already stays. An empty string, else the
// cause and the remedy, which never hold the content.
[[nodiscard]] std::string WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                                       bool replace);

// The group's id; nothing when there is none of that name.
[[nodiscard]] std::optional<gid_t> FindGroup(const std::string& name);

}  // namespace axlecast
