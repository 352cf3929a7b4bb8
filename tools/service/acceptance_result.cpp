#include "tools/service/acceptance_result.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"

namespace axlecast {
namespace {

constexpr std::string_view kStyle = R"(
@page { size: A4; margin: 16mm 14mm; }
:root { color-scheme: light; }
body { font: 10pt/1.4 "DejaVu Sans", "Liberation Sans", Arial, sans-serif; color: #1a1d21; background: #fff;
       max-width: 182mm; margin: 12mm auto; padding: 0 4mm; }
h1 { font-size: 17pt; margin: 0 0 2mm; }
h2 { font-size: 12.5pt; margin: 8mm 0 2mm; padding-bottom: 1mm; border-bottom: 0.4mm solid #2b5c8a; break-after: avoid; }
h3 { font-size: 10.5pt; margin: 5mm 0 1.5mm; break-after: avoid; }
p { margin: 1.5mm 0; }
table { border-collapse: collapse; width: 100%; margin: 1.5mm 0 3mm; }
th, td { text-align: left; vertical-align: top; padding: 1mm 2mm; border-bottom: 0.2mm solid #cfd5db;
         overflow-wrap: anywhere; }
th { background: #eef2f6; font-weight: 600; }
tr { break-inside: avoid; }
thead { display: table-header-group; }
th, .good, .attention, .bad, .muted, table:not(.facts) td:first-child { white-space: nowrap; }
.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.good { color: #1b6e33; font-weight: 600; }
.attention { color: #8a5a00; font-weight: 600; }
.bad { color: #a81d1d; font-weight: 700; }
.muted { color: #5b6570; }
.facts td:first-child { width: 32%; color: #3b444d; }
pre { font: 8.5pt/1.35 "DejaVu Sans Mono", "Liberation Mono", monospace; background: #f5f7f9; padding: 2mm 3mm;
      border: 0.2mm solid #dde2e7; white-space: pre-wrap; overflow-wrap: anywhere; }
@media print { body { margin: 0; padding: 0; max-width: none; } }
)";

std::string Element(std::string_view name, std::string_view text) {
  return '<' + std::string(name) + '>' + EscapedMarkup(text) + "</" + std::string(name) + ">\n";
}

std::string Rows(const std::vector<HtmlPage::Row>& rows) {
  std::string text = "<tbody>\n";
  for (const HtmlPage::Row& row : rows) {
    text += "<tr>";
    for (const HtmlPage::Cell& cell : row) {
      text += cell.mark.empty() ? "<td>" : "<td class=\"" + std::string(cell.mark) + "\">";
      text += EscapedMarkup(cell.text) + "</td>";
    }
    text += "</tr>\n";
  }
  return text + "</tbody>\n</table>\n";
}

constexpr std::size_t kWhatWidth = 22;
constexpr std::size_t kVerdictWidth = 11;

std::string Padded(std::string text, std::size_t width) {
  text.resize(std::max(text.size() + 1, width), ' ');
  return text;
}

}  // namespace

std::string_view VerdictName(Verdict verdict) {
  static constexpr std::array<std::string_view, 4> kNames = {"good", "not judged", "attention", "bad"};
  return kNames.at(static_cast<std::size_t>(verdict));
}

Verdict Worst(const Findings& findings) {
  Verdict worst = Verdict::kGood;
  for (const FindingGroup& group : findings) {
    for (const AcceptanceResult& finding : group.findings) worst = std::max(worst, finding.verdict);
  }
  return worst;
}

std::string FindingsText(const Findings& findings) {
  std::string text;
  for (const FindingGroup& group : findings) {
    text += group.title + '\n';
    for (const AcceptanceResult& finding : group.findings) {
      text += std::string(2, ' ') + Padded(std::string(VerdictName(finding.verdict)), kVerdictWidth) +
              Padded(finding.what, kWhatWidth) + finding.value + '\n';
      if (finding.advice.empty()) continue;
      text.append(2 + kVerdictWidth, ' ').append("-> ").append(finding.advice).append(1, '\n');
    }
  }
  return text;
}

nlohmann::ordered_json FindingsJson(const Findings& findings) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const FindingGroup& group : findings) {
    for (const AcceptanceResult& finding : group.findings) {
      list.push_back({{"group", group.title},
                      {"what", finding.what},
                      {"value", finding.value},
                      {"verdict", VerdictName(finding.verdict)},
                      {"advice", finding.advice}});
    }
  }
  return list;
}

HtmlPage::HtmlPage(std::string_view title) : title_(title), body_(Element("h1", title)) {}

void HtmlPage::Heading(std::string_view text) { body_ += Element("h2", text); }
void HtmlPage::SubHeading(std::string_view text) { body_ += Element("h3", text); }
void HtmlPage::Paragraph(std::string_view text) { body_ += Element("p", text); }
void HtmlPage::Listing(std::string_view text) { body_ += Element("pre", text); }

void HtmlPage::Table(const std::vector<std::string>& head, const std::vector<Row>& rows) {
  body_ += "<table>\n<thead><tr>";
  for (const std::string& column : head) body_ += "<th>" + EscapedMarkup(column) + "</th>";
  body_ += "</tr></thead>\n" + Rows(rows);
}

void HtmlPage::Facts(const std::vector<Row>& rows) { body_ += "<table class=\"facts\">\n" + Rows(rows); }

std::string HtmlPage::Text() const {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src &#39;none&#39;; style-src "
         "&#39;unsafe-inline&#39;\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         EscapedMarkup(title_) + "</title>\n<style>" + std::string(kStyle) + "</style>\n</head>\n<body>\n" + body_ +
         "</body>\n</html>\n";
}

void AddFindings(HtmlPage& page, const Findings& findings) {
  for (const FindingGroup& group : findings) {
    page.Heading(group.title);
    std::vector<HtmlPage::Row> rows;
    for (const AcceptanceResult& finding : group.findings) {
      const std::string_view mark = finding.verdict == Verdict::kUnjudged ? "muted" : VerdictName(finding.verdict);
      rows.push_back(
          {{finding.what}, {finding.value}, {std::string(VerdictName(finding.verdict)), mark}, {finding.advice}});
    }
    page.Table({"what", "seen", "verdict", "what to do"}, rows);
  }
}

}  // namespace axlecast
