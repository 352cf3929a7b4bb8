#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/service/html_page.h"

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
void AddFindings(HtmlPage& page, const Findings& findings);

}  // namespace axlecast
