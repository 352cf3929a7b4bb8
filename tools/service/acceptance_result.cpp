#include "tools/service/acceptance_result.h"

#include <algorithm>
#include <array>

namespace axlecast {
namespace {

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
      text += "  " + Padded(std::string(VerdictName(finding.verdict)), kVerdictWidth) +
              Padded(finding.what, kWhatWidth) + finding.value + '\n';
      if (!finding.advice.empty()) text += std::string(2 + kVerdictWidth, ' ') + "-> " + finding.advice + '\n';
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
