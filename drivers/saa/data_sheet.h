#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

// What Rongde Optics' "Integrated Reflective Encoder SAA Series, Operation Manual" states of every encoder of the series,
// whatever line it is ordered with. Each of these lines is a family of its own; none of them includes another one.
namespace axlecast::saa {

// Chapter 3: "saa" is any of them. They differ in size only.
inline constexpr std::array<std::string_view, 7> kModels = {"saa",      "saa37p8",   "saa58p24",  "saa70p30",
                                                            "saa90p50", "saa130p90", "saa290p184"};

// 4.1: "Resolution in Bit".
inline constexpr int kMinBits = 10;
inline constexpr int kMaxBits = 26;

// 4.2: "Max. Rotational Speed".
inline constexpr double kMaxSpeedRpm = 5'000;

// Returns the accuracy of table 4.1 in arc seconds, either way; nothing below 16 bits, for which the table gives none.
// Above 26 bits, which no encoder of the series has, it is that of 26.
[[nodiscard]] std::optional<int> AccuracyArcSeconds(int bits);

// Returns the largest difference in counts, rounded up, between two readings of one place: twice the accuracy, because
// the manual states no repeatability. One count where the manual gives no accuracy.
[[nodiscard]] std::int64_t NoiseCounts(int bits);

}  // namespace axlecast::saa
