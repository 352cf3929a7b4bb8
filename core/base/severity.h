#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace axlecast {

// alarm_entry_t SEVERITY_* as words, in their order.
inline constexpr std::array<std::string_view, 4> kSeverityNames = {"info", "warning", "error", "critical"};

// Above every severity.
inline constexpr std::uint8_t kNoSeverity = kSeverityNames.size();

[[nodiscard]] inline std::optional<std::uint8_t> ParseSeverity(std::string_view word) {
  const auto* const found = std::find(kSeverityNames.begin(), kSeverityNames.end(), word);
  if (found == kSeverityNames.end()) return std::nullopt;
  return static_cast<std::uint8_t>(found - kSeverityNames.begin());
}

}  // namespace axlecast
