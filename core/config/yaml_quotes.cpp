#include "core/config/yaml_quotes.h"

#include <cstddef>

namespace axlecast {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

// Goes through a text line by line, and knows where a quote opens a value instead of standing within one.
class QuoteScan {
 public:
  std::optional<OpenQuote> Run(std::string_view text) {
    for (int number = 0; !text.empty(); ++number) {
      const std::size_t end = text.find('\n');
      if (const auto column = ScanLine(text.substr(0, end))) {
        return OpenQuote{.line = number,
                         .column = static_cast<int>(*column),
                         .quote = text[*column],
                         .closed = EndOfQuote(text, *column) != std::string_view::npos};
      }
      if (end == std::string_view::npos) break;
      text.remove_prefix(end + 1);
    }
    return std::nullopt;
  }

 private:
  // Where a quote opens that the line does not close.
  std::optional<std::size_t> ScanLine(std::string_view line) {
    std::size_t at = 0;
    while (at < line.size() && IsBlank(line[at])) ++at;
    if (at == line.size()) return std::nullopt;
    if (in_block_ && at > block_indentation_) return std::nullopt;  // a text of | or >: its quotes are characters
    in_block_ = false;
    indentation_ = at;
    begins_value_ = true;
    while (at < line.size()) {
      const std::size_t next = Step(line, at);
      if (next == std::string_view::npos) return at;
      at = next;
    }
    return std::nullopt;
  }

  // Returns where to go on; npos: the quote at `at` stays open.
  std::size_t Step(std::string_view line, std::size_t at) {
    const char c = line[at];
    const bool after_blank = at == 0 || IsBlank(line[at - 1]);
    const bool before_blank = at + 1 == line.size() || IsBlank(line[at + 1]);
    if (IsBlank(c)) return at + 1;
    if (c == '#' && after_blank) return line.size();
    if ((c == '"' || c == '\'') && begins_value_) {
      const std::size_t end = EndOfQuote(line, at);
      begins_value_ = false;
      return end;
    }
    if ((c == '|' || c == '>') && begins_value_ && flow_ == 0) {
      in_block_ = true;
      block_indentation_ = indentation_;
      return line.size();
    }
    begins_value_ = BeginsValueBehind(c, before_blank);
    return at + 1;
  }

  bool BeginsValueBehind(char c, bool before_blank) {
    if ((c == '[' || c == '{') && (begins_value_ || flow_ > 0)) {
      ++flow_;
      return true;
    }
    if ((c == ']' || c == '}') && flow_ > 0) --flow_;
    if (c == ',' && flow_ > 0) return true;
    if (c == ':' && before_blank) return true;
    return (c == '-' || c == '?') && before_blank && begins_value_;
  }

  static std::size_t EndOfQuote(std::string_view line, std::size_t begin) {
    const char quote = line[begin];
    for (std::size_t at = begin + 1; at < line.size(); ++at) {
      if (quote == '"' && line[at] == '\\') {
        ++at;
      } else if (line[at] == quote) {
        const bool doubled = quote == '\'' && at + 1 < line.size() && line[at + 1] == quote;
        if (!doubled) return at + 1;
        ++at;
      }
    }
    return std::string_view::npos;
  }

  int flow_ = 0;  // depth of [ and {
  bool begins_value_ = true;
  std::size_t indentation_ = 0;
  bool in_block_ = false;
  std::size_t block_indentation_ = 0;
};

}  // namespace

std::optional<OpenQuote> FindOpenQuote(std::string_view text) { return QuoteScan().Run(text); }

}  // namespace axlecast
