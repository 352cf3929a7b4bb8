#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// A self-contained HTML page without scripts or loaded files, for A4 and for a screen. All texts are escaped.
class HtmlPage {
 public:
  struct Cell {
    std::string text;
    std::string_view mark = {};  // "good", "attention", "bad", "number", "muted"; empty: no mark
  };
  using Row = std::vector<Cell>;

  explicit HtmlPage(std::string_view title);

  void Heading(std::string_view text);
  void SubHeading(std::string_view text);
  void Paragraph(std::string_view text);
  void Table(const std::vector<std::string>& head, const std::vector<Row>& rows);
  // Adds a table with two columns: name and value.
  void Facts(const std::vector<Row>& rows);
  void Listing(std::string_view text);  // unchanged, line by line

  [[nodiscard]] std::string Text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace axlecast
