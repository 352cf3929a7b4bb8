#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

#include "platform/os/descriptor.h"

namespace axlecast {

// Who may use a file that is written.
struct FileAccess {
  mode_t mode = 0600;
  std::optional<gid_t> group = std::nullopt;  // none: this process's
  std::optional<uid_t> owner = std::nullopt;  // likewise; another one takes root
};

// A file that is written piece by piece and stands at `path` only once it is whole and on disk. Nobody ever sees a part
// of it, or sees it more open than `access` says; without Commit nothing is left of it.
class NewFile {
 public:
  NewFile(std::string path, const FileAccess& access);
  ~NewFile();
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  // Each: an empty string, else the cause and the remedy, which never hold the content. After a problem the file is
  // given up.
  [[nodiscard]] std::string Append(std::string_view content);
  // Puts it in its place. Without `replace` a file that is there already stays. With `keep` such a file stays under
  // that name, which must be a free one in the same folder; at any instant a whole file stands at `path`.
  [[nodiscard]] std::string Commit(bool replace, const std::string& keep = "");

 private:
  std::string path_;
  std::string fresh_;  // its name until then
  Descriptor file_;
  std::string problem_;
};

// Puts a file with this content at `path` in one step, on disk when it returns: nobody ever sees a part of it, or sees
// it more open than `access` says. Without `replace` a file that is there already stays. An empty string, else the
// cause and the remedy, which never hold the content.
[[nodiscard]] std::string WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                                       bool replace);

// Puts a result where an operator wants it: a file in one step, in the place of one that is there; into anything else
// (/dev/stdout, a pipe, where a link leads) it is written. An empty string, else the cause.
[[nodiscard]] std::string WriteOutput(const std::string& path, std::string_view content);

// The group's id; nothing when there is none of that name.
[[nodiscard]] std::optional<gid_t> FindGroup(const std::string& name);

}  // namespace axlecast
