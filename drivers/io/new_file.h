#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Who may use a file that is written.
struct FileAccess {
  mode_t mode = 0600;
  std::optional<gid_t> group = std::nullopt;  // none: this process's
};

// Puts a file with this content at `path` in one step, on disk when it returns: nobody ever sees a part of it, or sees
// it more open than `access` says. Without `replace` a file that is there already stays. An empty string, else the
// cause and the remedy, which never hold the content.
[[nodiscard]] std::string WriteNewFile(const std::string& path, std::string_view content, const FileAccess& access,
                                       bool replace);

// The group's id; nothing when there is none of that name.
[[nodiscard]] std::optional<gid_t> FindGroup(const std::string& name);

}  // namespace axlecast
