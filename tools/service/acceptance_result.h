#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tools/service/html_page.h"

namespace axlecast {

enum class Verdict : std::uint8_t {
  kGood,
  kUnjudged,   // told, but nothing can be said of it here
  kAttention,  // works, and should be looked at
  kBad,
};
[[nodiscard]] std::string_view VerdictName(Verdict verdict);  // "good"

// One line of an acceptance report.
struct AcceptanceResult {
  std::string what;   // "turnaround"
  std::string value;  // what was seen
  Verdict verdict = Verdict::kUnjudged;
  std::string advice;  // what to do; empty when there is nothing to do
};

struct FindingGroup {
  std::string title;
  std::vector<AcceptanceResult> findings;
};
using Findings = std::vector<FindingGroup>;

[[nodiscard]] Verdict Worst(const Findings& findings);  // kGood when there is none

[[nodiscard]] std::string FindingsText(const Findings& findings);
[[nodiscard]] nlohmann::ordered_json FindingsJson(const Findings& findings);
void AddFindings(HtmlPage& page, const Findings& findings);

}  // namespace axlecast
