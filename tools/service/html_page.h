#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// One page of HTML that stands for itself: no script, nothing that is loaded, made for A4 and for a screen. All texts are
// escaped, whatever they hold.
class HtmlPage {
 public:
  struct Cell {
    std::string text;
    std::string_view mark = {};  // "good", "attention", "bad", "number", "muted"; empty: none
  };
  using Row = std::vector<Cell>;

  explicit HtmlPage(std::string_view title);

  void Heading(std::string_view text);
  void SubHeading(std::string_view text);
  void Paragraph(std::string_view text);
  void Table(const std::vector<std::string>& head, const std::vector<Row>& rows);
  // Two columns: what, and its value.
  void Facts(const std::vector<Row>& rows);
  void Listing(std::string_view text);  // as it is, line for line

  [[nodiscard]] std::string Text() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace axlecast
