#pragma once

#include <cstddef>
#include <string>

namespace axlecast {

// Long lists of numbers as JSON text: a tree of JSON values would cost several times their memory.

// Appends the number with 10 digits, which is more than any device measures, or null if it is not finite.
void AppendNumber(std::string& text, double value);

// Appends a list of what `append(i)` appends for each index from `begin` to `end`.
template <typename Index, typename Append>
void AppendList(std::string& text, Index begin, Index end, const Append& append) {
  text += '[';
  for (Index i = begin; i < end; ++i) {
    if (i != begin) text += ',';
    append(i);
  }
  text += ']';
}

}  // namespace axlecast
