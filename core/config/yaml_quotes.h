#pragma once

#include <optional>
#include <string_view>

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

}  // namespace axlecast
