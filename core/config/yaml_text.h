#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/config/config_map.h"

namespace axlecast {

// A quote of a YAML text, counted from 0 as YAML::Mark counts.
struct OpenQuote {
  int line = 0;
  int column = 0;
  char quote = '"';
  bool closed = false;  // in a later line
};

// Returns the first quoted value that is not closed in the line where it opens. YAML allows it; where a text is no YAML,
// it is the likely mistake, and the parser reports it far behind, often only at the end of the text.
[[nodiscard]] std::optional<OpenQuote> FindOpenQuote(std::string_view text);

inline constexpr std::size_t kMaxYamlText = 512UL * 1024;  // bytes of one text

// Parses a YAML text with one document. Also reports what yaml-cpp accepts: a duplicate key, a key that is not plain text, a
// second document, a text that is too large or nested too deeply. The node is undefined if there is no usable content.
[[nodiscard]] YAML::Node ParseYaml(const std::string& text, ConfigErrors& errors);

// Returns the 64-bit FNV-1a hash of the mapping's canonical text. It shows whether two runs had the same configuration of a
// device.
// Canonical: {"key":value,...} with the keys in byte order, [value,...], and every scalar as the file's characters
// in quotes, so comments, order and layout do not count, but 5 and 5.0 differ.
[[nodiscard]] std::int64_t ConfigHash(const YAML::Node& device);

}  // namespace axlecast
