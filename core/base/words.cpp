#include "core/base/words.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "core/base/terminal_text.h"
#include "core/base/utf8.h"

namespace axlecast {
namespace {

// A name in the file is never longer; what is, resembles nothing.
constexpr std::size_t kLongestWord = 64;

// Insertions, deletions, exchanges and swaps of neighbours that lead from one word to the other.
std::size_t EditDistance(std::string_view from, std::string_view to) {
  std::vector<std::size_t> before(to.size() + 1);
  std::vector<std::size_t> last(to.size() + 1);
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(last.begin(), last.end(), std::size_t{0});
  for (std::size_t i = 1; i <= from.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= to.size(); ++j) {
      const std::size_t exchange = last[j - 1] + (from[i - 1] == to[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, exchange});
      if (i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[to.size()];
}

}  // namespace

std::optional<std::string> NearestWord(std::string_view word, const std::vector<std::string>& known) {
  if (word.empty() || word.size() > kLongestWord) return std::nullopt;
  std::optional<std::string> nearest;
  std::size_t smallest = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const bool shortened = word.size() >= 3 && candidate.starts_with(word);
    const std::size_t distance = shortened ? 1 : EditDistance(word, candidate);
    if (distance >= smallest || distance >= candidate.size()) continue;
    smallest = distance;
    nearest = candidate;
  }
  return nearest;
}

std::string Listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ", ";
    text += word;
  }
  return text;
}

std::string Quoted(std::string_view value) {
  constexpr std::size_t kShown = 40;
  const std::string_view begin = Shortened(value, kShown);
  return "'" + TerminalText(begin, TextShape::kOneLine) + (begin.size() < value.size() ? "...'" : "'");
}

bool IsName(std::string_view text) {
  constexpr std::size_t kLongest = 24;
  return !text.empty() && text.size() <= kLongest &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_-") == std::string_view::npos;
}

}  // namespace axlecast
