#pragma once

#include <yaml-cpp/yaml.h>

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

// The one document of a YAML text. Reports what yaml-cpp would pass over in silence: a key that stands twice, a key
// that is no plain text, a second document, a text larger or nested deeper than any machine's. The node is
// undefined when there is nothing to go on with.
[[nodiscard]] YAML::Node ParseYaml(const std::string& text, ConfigErrors& errors);

// Tells whether two runs had the same configuration of a device: FNV-1a, 64 bits, of the mapping's canonical text.
// Canonical: {"key":value,...} with the keys in byte order, [value,...], and every scalar as the file's characters
// in quotes, so comments, order and layout do not count, but 5 and 5.0 differ.
[[nodiscard]] std::int64_t ConfigHash(const YAML::Node& device);

}  // namespace axlecast
