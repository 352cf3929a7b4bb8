#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axlecast {

enum class Verdict : std::uint8_t {
  kGood,
  kUnjudged,   // only reported: it cannot be evaluated here
  kAttention,  // works, but should be checked
  kBad,
};
[[nodiscard]] std::string_view VerdictName(Verdict verdict);  // "good"

// One line of an acceptance report.
struct AcceptanceResult {
  std::string what;   // "turnaround"
  std::string value;  // what was observed
  Verdict verdict = Verdict::kUnjudged;
  std::string advice;  // what to do, or empty
};

struct FindingGroup {
  std::string title;
  std::vector<AcceptanceResult> findings;

  void Add(std::string what, std::string value, Verdict verdict = Verdict::kUnjudged, std::string advice = "") {
    findings.push_back({std::move(what), std::move(value), verdict, std::move(advice)});
  }
};
using Findings = std::vector<FindingGroup>;

[[nodiscard]] Verdict Worst(const Findings& findings);  // kGood without findings

[[nodiscard]] std::string FindingsText(const Findings& findings);
[[nodiscard]] nlohmann::ordered_json FindingsJson(const Findings& findings);

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

// Adds a table for each group.
void AddFindings(HtmlPage& page, const Findings& findings);

}  // namespace axlecast
