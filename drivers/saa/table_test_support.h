#pragma once

#include <array>
#include <cstdint>

namespace axlecast::saa {

// One column of the SAA manual's table 4.1, copied by hand, and what follows from it.
struct TableColumn {
  int bits;
  double resolution;   // "Angular Resolution", arc seconds as printed: rounded or truncated by the maker
  int accuracy;        // "Accuracy <=", arc seconds either way
  std::int64_t noise;  // twice the accuracy in counts of 1,296,000 / 2^bits arc seconds, rounded up by hand
};

// All columns that have an accuracy. Of "11-15 bit" the table gives neither value; 10 bits are in its heading only.
inline constexpr std::array<TableColumn, 11> kTable41 = {{
    {16, 20, 40, 5},      // 80" of 19.8"
    {17, 10, 20, 5},      // 40" of 9.89"
    {18, 5, 20, 9},       // 40" of 4.94"
    {19, 2.5, 15, 13},    // 30" of 2.47"
    {20, 1.2, 15, 25},    // 30" of 1.24"
    {21, 0.6, 10, 33},    // 20" of 0.618"
    {22, 0.3, 8, 52},     // 16" of 0.309"
    {23, 0.15, 6, 78},    // 12" of 0.154"
    {24, 0.08, 5, 130},   // 10" of 0.0772"
    {25, 0.03, 5, 259},   // 10" of 0.0386"
    {26, 0.019, 5, 518},  // 10" of 0.0193"
}};

// True where one count of this many arc seconds is what the column prints. Each printed value is within 6 % of the true
// one, but for 25 bits: the manual prints 0.03 for 0.0386, an erratum (README.md of each family).
inline bool IsPrintedResolution(const TableColumn& column, double arc_seconds) {
  const double printed = column.bits == 25 ? 0.0386 : column.resolution;
  return arc_seconds > 0.94 * printed && arc_seconds < 1.06 * printed;
}

}  // namespace axlecast::saa
