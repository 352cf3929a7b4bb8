#pragma once

#include <span>
#include <string_view>

namespace axlecast {

// A file of the page, part of the program.
struct PageFile {
  std::string_view name;  // "index.html"
  std::string_view type;  // for Content-Type
  std::string_view etag;  // of its content, with its quotation marks
  std::string_view content;
};

[[nodiscard]] std::span<const PageFile> PageFiles();

}  // namespace axlecast
