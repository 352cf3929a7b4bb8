#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

namespace axlecast::bench {

// Prints `"name": {n, p50, p99, max}` of durations in ns, in us. NaN is no JSON: without any, the figures are null.
inline void PrintDistribution(const char* name, std::vector<std::int64_t> durations) {
  if (durations.empty()) {
    std::printf("\"%s\": {\"n\": 0, \"p50_us\": null, \"p99_us\": null, \"max_us\": null}", name);
    return;
  }
  std::sort(durations.begin(), durations.end());
  const auto at = [&durations](double share) {
    const auto rank = static_cast<std::size_t>(share * static_cast<double>(durations.size() - 1));
    return static_cast<double>(durations[rank]) * 1e-3;
  };
  std::printf("\"%s\": {\"n\": %zu, \"p50_us\": %.3f, \"p99_us\": %.3f, \"max_us\": %.3f}", name, durations.size(),
              at(0.5), at(0.99), at(1.0));
}

}  // namespace axlecast::bench
